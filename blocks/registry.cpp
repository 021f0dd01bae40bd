#include <blockid/blocks/registry.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/names.hpp>
#include <blockid/blocks/detail/placed_error.hpp>
#include <blockid/blocks/text.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace blockid {
namespace {

/// "a, b, c".
template <class Range, class Name>
std::string joined(const Range& range, Name&& name) {
  std::string text;
  for (const auto& entry : range) {
    if (!text.empty()) text += ", ";
    text += name(entry);
  }
  return text;
}

std::string shortened(std::string text) {
  constexpr std::size_t kMaxShown = 60;
  if (text.size() > kMaxShown) text = text.substr(0, kMaxShown) + "...";
  return text;
}

/// "the number 3", "the word 'abc'".
std::string described(const BlockArguments::Value& value) {
  if (const auto* number = std::get_if<double>(&value)) return "the number " + detail::number_text(*number);
  if (const auto* word = std::get_if<std::string>(&value)) return "the word '" + shortened(*word) + "'";
  if (const auto* list = std::get_if<std::vector<double>>(&value)) {
    return "the list " + shortened(detail::list_text(*list));
  }
  return "the block " + shortened(to_nested_text(std::get<AnyBlock>(value)));
}

std::string key_list(const std::vector<ArgumentKey>& keys) {
  if (keys.empty()) return "no arguments";
  return joined(keys, [](const ArgumentKey& key) {
    const std::string name = key.key.empty() ? "a nested block" : key.key;
    return key.description.empty() ? name : name + " (" + key.description + ")";
  });
}

}  // namespace

BlockArguments::BlockArguments(std::string kind, std::vector<Argument> arguments, std::size_t position)
    : kind_(std::move(kind)), arguments_(std::move(arguments)), position_(position), read_(arguments_.size(), false) {
  std::set<std::string_view> seen;
  for (const Argument& argument : arguments_) {
    if (!argument.key.empty() && !seen.insert(argument.key).second) {
      detail::fail_at(argument.position, kind_, ": the key '", argument.key, "' comes twice");
    }
  }
}

const BlockArguments::Argument* BlockArguments::find(std::string_view key) const {
  const auto found =
      std::find_if(arguments_.begin(), arguments_.end(), [&](const Argument& argument) { return argument.key == key; });
  return found == arguments_.end() ? nullptr : &*found;
}

const BlockArguments::Argument& BlockArguments::get(std::string_view key) const {
  const Argument* argument = find(key);
  if (argument == nullptr) {
    detail::fail_at(position_, kind_, ": the key '", key, "' is required, write ", kind_, "(", key, "=...)");
  }
  read_[static_cast<std::size_t>(argument - arguments_.data())] = true;
  return *argument;
}

void BlockArguments::fail_type(const Argument& argument, std::string_view expected) const {
  detail::fail_at(argument.position, kind_, ": ", argument.key, " must be ", expected, ", got ",
                  described(argument.value));
}

void BlockArguments::refuse(std::string_view key, const std::string& message) const {
  const Argument* argument = find(key);
  detail::fail_at(argument == nullptr ? position_ : argument->position, kind_, ": ", message);
}

bool BlockArguments::is_list(std::string_view key) const {
  const Argument* argument = find(key);
  return argument != nullptr && std::holds_alternative<std::vector<double>>(argument->value);
}

Index BlockArguments::integer(std::string_view key, IntegerLimits limits) const {
  const Argument& argument = get(key);
  const std::string expected = compose("a whole number in ", limits.min, "..", limits.max);
  const auto* number = std::get_if<double>(&argument.value);
  if (number == nullptr || std::trunc(*number) != *number || *number < static_cast<double>(limits.min) ||
      *number > static_cast<double>(limits.max)) {
    fail_type(argument, expected);
  }
  return static_cast<Index>(*number);
}

Index BlockArguments::integer_or(std::string_view key, Index fallback, IntegerLimits limits) const {
  return has(key) ? integer(key, limits) : fallback;
}

double BlockArguments::number(std::string_view key) const {
  const Argument& argument = get(key);
  const auto* value = std::get_if<double>(&argument.value);
  if (value == nullptr || !std::isfinite(*value)) fail_type(argument, "a number");
  return *value;
}

double BlockArguments::number_or(std::string_view key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

bool BlockArguments::flag(std::string_view key) const {
  const Argument& argument = get(key);
  const auto* value = std::get_if<std::string>(&argument.value);
  if (value == nullptr || (*value != "true" && *value != "false")) fail_type(argument, "true or false");
  return *value == "true";
}

bool BlockArguments::flag_or(std::string_view key, bool fallback) const { return has(key) ? flag(key) : fallback; }

std::string BlockArguments::word(std::string_view key, std::initializer_list<std::string_view> allowed) const {
  const Argument& argument = get(key);
  const auto* value = std::get_if<std::string>(&argument.value);
  if (value == nullptr || std::find(allowed.begin(), allowed.end(), *value) == allowed.end()) {
    fail_type(argument, "one of " + joined(allowed, [](std::string_view one) { return std::string(one); }));
  }
  return *value;
}

std::string BlockArguments::word_or(std::string_view key, std::string_view fallback,
                                    std::initializer_list<std::string_view> allowed) const {
  return has(key) ? word(key, allowed) : std::string(fallback);
}

std::vector<double> BlockArguments::list(std::string_view key) const {
  const Argument& argument = get(key);
  const auto* value = std::get_if<std::vector<double>>(&argument.value);
  if (value == nullptr) fail_type(argument, "a list of numbers such as [-1,0,1]");
  return *value;
}

std::pair<double, double> BlockArguments::range(std::string_view key) const {
  const Argument& argument = get(key);
  const auto* value = std::get_if<std::vector<double>>(&argument.value);
  if (value == nullptr || value->size() != 2 || !((*value)[0] < (*value)[1])) {
    fail_type(argument, "two numbers [lower,upper] with lower < upper");
  }
  return {(*value)[0], (*value)[1]};
}

std::vector<AnyBlock> BlockArguments::blocks() const {
  std::vector<AnyBlock> nested;
  for (std::size_t k = 0; k < arguments_.size(); ++k) {
    if (const auto* block = std::get_if<AnyBlock>(&arguments_[k].value)) {
      nested.push_back(*block);
      read_[k] = true;
    }
  }
  return nested;
}

AnyBlock BlockArguments::block() const {
  std::vector<AnyBlock> nested = blocks();
  if (nested.size() != 1) {
    detail::fail_at(position_, kind_, ": expected exactly one nested block, got ", nested.size());
  }
  return nested.front();
}

std::vector<std::string> BlockArguments::unread() const {
  std::vector<std::string> keys;
  for (std::size_t k = 0; k < arguments_.size(); ++k) {
    if (!read_[k]) keys.push_back(arguments_[k].key);
  }
  return keys;
}

void Registry::add(std::string kind, std::vector<ArgumentKey> keys, Factory factory, std::string description) {
  if (!detail::is_name(kind)) {
    fail("registry: a kind must be a name of letters, digits and _ that starts with no digit, got '", kind, "'");
  }
  if (kind == "series" || kind == "parallel" || kind == "custom") {
    fail("registry: the kind '", kind, "' is reserved");
  }
  if (contains(kind)) fail("registry: the kind '", kind, "' is already there");
  if (!factory) fail("registry: the kind '", kind, "' has no factory");
  std::set<std::string_view> seen;
  for (const ArgumentKey& key : keys) {
    if (!key.key.empty() && !detail::is_name(key.key)) {
      fail("registry: a key of '", kind, "' must be a name of letters, digits and _ that starts with no digit, got '",
           key.key, "'");
    }
    if (!seen.insert(key.key).second) fail("registry: the key '", key.key, "' of '", kind, "' comes twice");
  }
  kinds_.emplace(kind, Kind{kind, std::move(keys), std::move(description), std::move(factory)});
}

const Registry::Kind& Registry::at(std::string_view kind) const {
  const auto found = kinds_.find(kind);
  if (found == kinds_.end()) {
    fail("unknown kind of block '", shortened(std::string(kind)), "'; known are ",
         joined(kinds_, [](const auto& entry) { return entry.first; }));
  }
  return found->second;
}

std::vector<Registry::Kind> Registry::kinds() const {
  std::vector<Kind> all;
  for (const auto& [name, kind] : kinds_) all.push_back(kind);
  return all;
}

AnyBlock Registry::make(const BlockArguments& arguments) const {
  const Kind& kind = at(arguments.kind());
  for (const BlockArguments::Argument& argument : arguments.all()) {
    const bool known = std::any_of(kind.keys.begin(), kind.keys.end(),
                                   [&](const ArgumentKey& key) { return key.key == argument.key; });
    if (known) continue;
    if (argument.key.empty()) {
      detail::fail_at(argument.position, kind.kind, " takes no nested block; it takes ", key_list(kind.keys));
    }
    detail::fail_at(argument.position, kind.kind, " has no key '", shortened(argument.key), "'; it takes ",
                    key_list(kind.keys));
  }
  AnyBlock block = kind.factory(arguments);
  for (const std::string& key : arguments.unread()) {
    arguments.refuse(key, key.empty() ? "a nested block has no effect beside the other arguments"
                                      : "the key '" + key + "' has no effect beside the other arguments");
  }
  return block;
}

}  // namespace blockid
