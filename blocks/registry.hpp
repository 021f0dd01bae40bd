// Which kinds of block the text form knows, and what each is made of.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace blockid {

/// Least and largest integer allowed, both included.
struct IntegerLimits {
  Index min = 0;
  Index max = 1'000'000;
};

/// What stands between the parentheses of `kind(key=value, ...)`, read by type.
///
/// Every getter throws Error, naming kind, key, expectation and what came, when a required key is missing or a value is
/// of another type or outside its limits; within parse() the message also shows the place in the text.
class BlockArguments {
 public:
  /// A number, a word, a list of numbers, or a nested block.
  using Value = std::variant<double, std::string, std::vector<double>, AnyBlock>;

  struct Argument {
    /// Empty for a nested block.
    std::string key;
    Value value;
    /// First byte of the argument in the text.
    std::size_t position = 0;
  };

  /// position: first byte of the kind in the text. Throws Error when a key comes twice.
  BlockArguments(std::string kind, std::vector<Argument> arguments, std::size_t position = 0);

  const std::string& kind() const { return kind_; }
  const std::vector<Argument>& all() const { return arguments_; }
  std::size_t position() const { return position_; }

  bool has(std::string_view key) const { return find(key) != nullptr; }
  /// True when the key is given as a list `[...]`, for keys that may be a number or a list.
  bool is_list(std::string_view key) const;

  /// A whole number within the limits. Written `3`, `3.0` or `3e0`.
  Index integer(std::string_view key, IntegerLimits limits = {}) const;
  Index integer_or(std::string_view key, Index fallback, IntegerLimits limits = {}) const;

  /// A finite number.
  double number(std::string_view key) const;
  double number_or(std::string_view key, double fallback) const;

  /// `true` or `false`.
  bool flag(std::string_view key) const;
  bool flag_or(std::string_view key, bool fallback) const;

  /// One of the allowed words.
  std::string word(std::string_view key, std::initializer_list<std::string_view> allowed) const;
  std::string word_or(std::string_view key, std::string_view fallback,
                      std::initializer_list<std::string_view> allowed) const;

  /// Finite numbers `[1,2,3]`, any count.
  std::vector<double> list(std::string_view key) const;
  /// Two numbers `[lower,upper]` with lower < upper.
  std::pair<double, double> range(std::string_view key) const;

  /// The nested blocks, in order.
  std::vector<AnyBlock> blocks() const;
  /// The only nested block.
  AnyBlock block() const;

  /// Throws Error about the key's value, at its place.
  [[noreturn]] void refuse(std::string_view key, const std::string& message) const;

  /// Keys given that no getter has read; has() and is_list() do not count as reading.
  std::vector<std::string> unread() const;

 private:
  const Argument* find(std::string_view key) const;
  /// Throws Error when the key is missing; marks it as read.
  const Argument& get(std::string_view key) const;
  [[noreturn]] void fail_type(const Argument& argument, std::string_view expected) const;

  std::string kind_;
  std::vector<Argument> arguments_;
  std::size_t position_;
  mutable std::vector<bool> read_;
};

/// A key of a block kind with a line of explanation. The key "" stands for nested blocks.
struct ArgumentKey {
  std::string key;
  std::string description;
};

/// The kinds of block that parse() understands: a value that one copies, extends and passes on.
///
/// A kind of one's own, here y = u + theta_1 u^3 with nothing to choose:
///
///   struct Cubic {
///     std::string kind() const { return "cubic"; }
///     Index parameter_count() const { return 1; }
///     template <class T>
///     void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
///       for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] + theta[0] * u[t] * u[t] * u[t];
///     }
///   };
///   Registry registry = standard_registry();
///   registry.add("cubic", {}, [](const BlockArguments&) { return Cubic{}; });
///   AnyBlock chain = parse("G=rational(nb=1,na=1) | f=cubic", registry);
///
/// The block's kind() is the name it is added by; its arguments() give the same keys, so that to_text() can be read
/// back.
class Registry {
 public:
  /// Makes the block; throws Error for arguments that do not fit.
  using Factory = std::function<AnyBlock(const BlockArguments&)>;

  struct Kind {
    std::string kind;
    /// In the order of the text form.
    std::vector<ArgumentKey> keys;
    std::string description;
    Factory factory;
  };

  /// Throws Error unless kind and keys are names [A-Za-z_][A-Za-z0-9_]* (one key may be "" and stands for nested
  /// blocks), the kind is new and not one of `series`, `parallel` and `custom`, no key comes twice, and there is a
  /// factory.
  void add(std::string kind, std::vector<ArgumentKey> keys, Factory factory, std::string description = {});

  bool contains(std::string_view kind) const { return kinds_.find(kind) != kinds_.end(); }

  /// Throws Error that lists the known kinds.
  const Kind& at(std::string_view kind) const;

  /// All kinds, by name.
  std::vector<Kind> kinds() const;

  /// The block of arguments.kind(). Throws Error for an unknown kind or key, for whatever the factory refuses, and for
  /// a key that the factory did not read: nothing given is ignored.
  AnyBlock make(const BlockArguments& arguments) const;

 private:
  std::map<std::string, Kind, std::less<>> kinds_;
};

/// The library's own kinds.
Registry standard_registry();

}  // namespace blockid
