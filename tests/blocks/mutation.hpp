// Random mutations of sample texts for fuzz tests, the same on every run.
#pragma once

#include <algorithm>
#include <cstddef>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace blockid::testing {

/// Texts made of a corpus by a few random edits each: bytes changed, pieces cut, doubled, swapped between texts, and
/// tokens of the grammar put in.
class Mutator {
 public:
  Mutator(std::vector<std::string> corpus, std::vector<std::string> tokens, unsigned seed)
      : corpus_(std::move(corpus)), tokens_(std::move(tokens)), generator_(seed) {}

  std::string next() {
    std::string text = one_of(corpus_);
    for (std::size_t edits = 1 + below(3); edits > 0; --edits) mutate(text);
    return text;
  }

 private:
  std::size_t below(std::size_t limit) { return std::uniform_int_distribution<std::size_t>(0, limit - 1)(generator_); }

  const std::string& one_of(const std::vector<std::string>& texts) { return texts[below(texts.size())]; }

  /// A piece of at most 20 bytes.
  std::string piece(const std::string& text) { return text.substr(below(text.size() + 1), below(20)); }

  void mutate(std::string& text) {
    const std::size_t at = below(text.size() + 1);
    switch (below(7)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
        break;
      case 1:
        text.erase(at, 1 + below(6));
        break;
      case 2:
        text.insert(at, piece(text));
        break;
      case 3:
        text.insert(at, piece(one_of(corpus_)));
        break;
      case 4:
        text.replace(at, std::min(text.size() - at, 1 + below(4)), one_of(tokens_));
        break;
      case 5:
        text.resize(at);
        break;
      default:
        text.insert(at, one_of(tokens_));
        break;
    }
  }

  std::vector<std::string> corpus_;
  std::vector<std::string> tokens_;
  std::mt19937 generator_;
};

}  // namespace blockid::testing
