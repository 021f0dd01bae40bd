#include <blockid/blocks/model_json.hpp>

#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace blockid {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "blockid-model";
constexpr int kVersion = 1;

/// Deeper than any model; keeps a hostile file from building a tree of brackets.
constexpr int kMaxDepth = 8;

/// A key as a step of a JSON pointer (RFC 6901), cut to a length fit for messages.
std::string escaped(std::string_view key) {
  constexpr std::size_t kShown = 60;
  std::string result;
  for (const char c : key.substr(0, kShown)) {
    if (c == '~') {
      result += "~0";
    } else if (c == '/') {
      result += "~1";
    } else {
      result += c >= ' ' && c <= '~' ? c : '?';
    }
  }
  return key.size() > kShown ? result + "..." : result;
}

/// Refuses members that come twice and deep nesting while the text is being read.
class Guard {
 public:
  explicit Guard(std::string_view source) : source_(source) {}

  bool operator()(int depth, json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        count_element();
        if (depth >= kMaxDepth) fail(source_, ": ", pointer(), ": expected at most ", kMaxDepth, " nested levels");
        frames_.push_back({event == json::parse_event_t::array_start, 0, {}, {}});
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        frames_.pop_back();
        break;
      case json::parse_event_t::key: {
        Frame& frame = frames_.back();
        frame.key = parsed.get_ref<const std::string&>();
        if (!frame.keys.insert(frame.key).second) fail(source_, ": ", pointer(), ": the member comes twice");
        break;
      }
      case json::parse_event_t::value:
        count_element();
        break;
    }
    return true;
  }

 private:
  struct Frame {
    bool is_array;
    std::size_t elements;
    std::string key;
    std::set<std::string> keys;
  };

  void count_element() {
    if (!frames_.empty() && frames_.back().is_array) ++frames_.back().elements;
  }

  std::string pointer() const {
    std::string result;
    for (const Frame& frame : frames_) {
      result += "/" + (frame.is_array ? std::to_string(frame.elements - 1) : escaped(frame.key));
    }
    return result.empty() ? "/" : result;
  }

  std::string source_;
  std::vector<Frame> frames_;
};

/// A value of the text with its place, read by type.
class Node {
 public:
  Node(const json& value, std::string source, std::string pointer)
      : value_(value), source_(std::move(source)), pointer_(std::move(pointer)) {}

  template <class... Parts>
  [[noreturn]] void refuse(const Parts&... parts) const {
    fail(source_, ": ", pointer_.empty() ? "/" : pointer_, ": ", parts...);
  }

  /// An object with these members; those that end in '?' may be absent.
  void check_members(std::initializer_list<std::string_view> members) const {
    if (!value_.is_object()) refuse("expected an object, got ", described());
    std::string known;
    std::set<std::string_view> names;
    for (std::string_view member : members) {
      const bool optional = member.ends_with('?');
      if (optional) member.remove_suffix(1);
      if (!optional && !value_.contains(member)) refuse("the member '", member, "' is missing");
      known += (known.empty() ? "" : ", ") + std::string(member);
      names.insert(member);
    }
    for (const auto& [key, unused] : value_.items()) {
      if (!names.contains(key)) refuse("unknown member '", escaped(key), "'; expected ", known);
    }
  }

  bool has(const char* key) const { return value_.contains(key); }
  Node member(const char* key) const { return {value_.at(key), source_, pointer_ + "/" + key}; }
  Node element(std::size_t k) const { return {value_.at(k), source_, pointer_ + "/" + std::to_string(k)}; }

  /// Elements of an array.
  std::size_t size() const {
    if (!value_.is_array()) refuse("expected an array, got ", described());
    return value_.size();
  }

  double number() const {
    if (!value_.is_number()) refuse("expected a number, got ", described());
    return value_.get<double>();
  }

  const std::string& text() const {
    if (!value_.is_string()) refuse("expected a text, got ", described());
    return value_.get_ref<const std::string&>();
  }

  /// The value itself when it is short, otherwise its type.
  std::string described() const {
    if (value_.is_structured()) return value_.is_array() ? "an array" : "an object";
    const std::string shown = value_.dump(-1, ' ', true, json::error_handler_t::replace);
    return shown.size() <= 60 ? shown : shown.substr(0, 60) + "...";
  }

 private:
  const json& value_;
  std::string source_;
  std::string pointer_;
};

/// What the JSON library has to say, without its own prefix "[json.exception...] " and without control characters.
std::string reason(const json::exception& error) {
  std::string text = error.what();
  const std::size_t end = text.find("] ");
  if (end != std::string::npos) text = text.substr(end + 2);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  constexpr std::size_t kShown = 300;
  return text.size() <= kShown ? text : text.substr(0, kShown) + "...";
}

json read_tree(std::string_view text, const std::string& source) {
  try {
    return json::parse(text.begin(), text.end(), Guard(source));
  } catch (const json::exception& error) {
    fail(source, ": expected JSON: ", reason(error));
  }
}

AnyBlock read_chain(const Node& node, const Registry& registry) {
  try {
    return parse(node.text(), registry);
  } catch (const Error& error) {
    node.refuse(error.what());
  }
}

void read_parameters(const Node& node, Model& model) {
  const Index expected = model.chain.parameter_count();
  if (static_cast<Index>(node.size()) != expected) {
    node.refuse("the chain has ", expected, " parameters, got ", node.size());
  }
  const std::vector<std::string> names = model.chain.parameter_names();
  const bool deviations = expected > 0 && node.element(0).has("standard_deviation");
  model.parameters.resize(expected);
  model.standard_deviations.resize(deviations ? expected : 0);
  for (Index k = 0; k < expected; ++k) {
    const Node parameter = node.element(static_cast<std::size_t>(k));
    parameter.check_members({"name", "value", "standard_deviation?"});
    const std::string& name = names[static_cast<std::size_t>(k)];
    if (parameter.member("name").text() != name) {
      parameter.member("name").refuse("expected \"", name, "\", got ", parameter.member("name").described());
    }
    model.parameters[k] = parameter.member("value").number();
    if (parameter.has("standard_deviation") != deviations) {
      parameter.refuse("expected a standard deviation with every parameter or with none");
    }
    if (!deviations) continue;
    const double deviation = parameter.member("standard_deviation").number();
    if (deviation < 0.0) parameter.member("standard_deviation").refuse("expected a number >= 0, got ", deviation);
    model.standard_deviations[k] = deviation;
  }
}

void read_initial_state(const Node& node, Model& model) {
  const Index count = static_cast<Index>(node.size());
  const Index expected = model.chain.state_count();
  if (count != 0 && count != expected) {
    node.refuse("the chain has ", expected, " states, expected as many numbers or none, got ", count);
  }
  model.initial_state.resize(count);
  for (Index k = 0; k < count; ++k) model.initial_state[k] = node.element(static_cast<std::size_t>(k)).number();
}

void read_signal(const Node& node, std::string& name, std::string& unit) {
  node.check_members({"name", "unit?"});
  name = node.member("name").text();
  if (node.has("unit")) unit = node.member("unit").text();
}

Model read_model(std::string_view text, const std::string& source, const Registry& registry) {
  const json tree = read_tree(text, source);
  const Node root(tree, source, "");
  // Another format or a later version is named first: its members mean something else.
  if (!tree.is_object()) root.refuse("expected an object, got ", root.described());
  if (!root.has("format")) root.refuse("the member 'format' is missing, expected \"", kFormat, "\"");
  if (root.member("format").text() != kFormat) {
    root.member("format").refuse("expected \"", kFormat, "\", got ", root.member("format").described());
  }
  if (!root.has("version")) root.refuse("the member 'version' is missing, expected ", kVersion);
  if (root.member("version").number() != kVersion) {
    root.member("version").refuse("expected ", kVersion, ", got ", root.member("version").described());
  }
  root.check_members(
      {"format", "version", "chain", "sample_time_s", "parameters", "initial_state?", "input?", "output?"});

  Model model{.chain = read_chain(root.member("chain"), registry), .parameters = {}};
  model.sample_time_s = root.member("sample_time_s").number();
  if (!(model.sample_time_s > 0.0)) {
    root.member("sample_time_s").refuse("expected a positive number, got ", root.member("sample_time_s").described());
  }
  read_parameters(root.member("parameters"), model);
  if (root.has("initial_state")) read_initial_state(root.member("initial_state"), model);
  if (root.has("input")) read_signal(root.member("input"), model.input_name, model.input_unit);
  if (root.has("output")) read_signal(root.member("output"), model.output_name, model.output_unit);
  check(model);
  return model;
}

void refuse_unreadable(const AnyBlock& block) {
  if (block.kind() == "custom") {
    fail("model: a block without kind() and a place in the registry cannot be read back from JSON");
  }
  for (const LabelledBlock& child : block.children()) refuse_unreadable(child.block);
  if (const auto* oversampled = block.target<Oversampled>()) refuse_unreadable(oversampled->inner());
}

void check_standard_deviations(const Model& model) {
  for (Index k = 0; k < model.standard_deviations.size(); ++k) {
    if (!std::isfinite(model.standard_deviations[k]) || model.standard_deviations[k] < 0.0) {
      fail("model: the standard deviation of ", model.chain.parameter_names()[static_cast<std::size_t>(k)],
           " must be finite and >= 0, got ", model.standard_deviations[k]);
    }
  }
}

/// A block that is no Series is read back as a Series of one, which names the parameters.
AnyBlock as_series(const AnyBlock& chain) {
  return chain.target<Series>() != nullptr ? chain : AnyBlock(Series({{"", chain}}));
}

std::string dumped(const nlohmann::ordered_json& value, const char* what) {
  try {
    return value.dump();
  } catch (const json::exception&) {
    fail("model: ", what, " must be UTF-8 text");
  }
}

std::string signal_text(const std::string& name, const std::string& unit, const char* what) {
  return dumped({{"name", name}, {"unit", unit}}, what);
}

}  // namespace

std::string to_json(const Model& model) {
  check(model);
  check_standard_deviations(model);
  refuse_unreadable(model.chain);
  const AnyBlock chain = as_series(model.chain);
  const std::vector<std::string> names = chain.parameter_names();

  std::string text = "{\n";
  text += "  \"format\": " + dumped(kFormat, "the format") + ",\n";
  text += "  \"version\": " + dumped(kVersion, "the version") + ",\n";
  text += "  \"chain\": " + dumped(to_text(chain), "the chain") + ",\n";
  text += "  \"sample_time_s\": " + dumped(model.sample_time_s, "the sample time") + ",\n";
  text += "  \"input\": " + signal_text(model.input_name, model.input_unit, "the input's name and unit") + ",\n";
  text += "  \"output\": " + signal_text(model.output_name, model.output_unit, "the output's name and unit") + ",\n";
  text += "  \"parameters\": [";
  for (Index k = 0; k < model.parameters.size(); ++k) {
    nlohmann::ordered_json parameter = {{"name", names[static_cast<std::size_t>(k)]}, {"value", model.parameters[k]}};
    if (model.standard_deviations.size() > 0) parameter["standard_deviation"] = model.standard_deviations[k];
    text += (k > 0 ? ",\n    " : "\n    ") + dumped(parameter, "the parameters' names");
  }
  text += model.parameters.size() > 0 ? "\n  ],\n" : "],\n";
  const std::vector<double> state(model.initial_state.begin(), model.initial_state.end());
  text += "  \"initial_state\": " + dumped(state, "the initial state") + "\n}\n";
  return text;
}

Model model_from_json(std::string_view text, const Registry& registry) {
  return read_model(text, "model JSON", registry);
}

void save_model(const std::filesystem::path& path, const Model& model) {
  std::string text;
  try {
    text = to_json(model);
  } catch (const Error& error) {
    fail(path.string(), ": ", error.what());
  }
  write_file_atomically(path, text);
}

Model load_model(const std::filesystem::path& path, const Registry& registry) {
  return read_model(read_file(path), path.string(), registry);
}

}  // namespace blockid
