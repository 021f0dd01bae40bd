// Text form of chains.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/registry.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace blockid {

/// Limits that keep a hostile text from exhausting stack or memory.
inline constexpr std::size_t kMaxChainText = std::size_t{1} << 20;
inline constexpr int kMaxChainDepth = 32;
inline constexpr int kMaxChainBlocks = 1000;

/// The block that a text describes, e.g. `G1=rational(nb=3,na=3) | f=spline(knots=20) | G2=rational(nb=3,na=3)`.
///
///   chain   := item ('|' item)*                      a row: the first block meets the input
///   item    := [label '='] primary
///   primary := kind ['(' [arg (',' arg)*] ')']
///            | '[' chain ('+' chain)* ']'            branches side by side, summed
///            | '(' chain ')'                         a row as one block
///   arg     := key '=' value
///            | chain                                 a nested block, or a row as one
///   value   := number | word | list
///   list    := '[' number (',' number)* ']'          spaces do instead of commas; two numbers also as [lower:upper]
///   label, kind, key, word := [A-Za-z_][A-Za-z0-9_]*
///
/// Blanks and line breaks between these pieces mean nothing. Numbers are decimal and finite. The result is a Series
/// even for a single item, so its label is kept. A branch of one item is that block with its label on the branch; a
/// branch of several items is a Series without a label.
///
/// Throws Error with line and column, what was expected and what came, and the text with the place marked: wrong
/// syntax, unknown kinds (with those known) and keys (with those allowed), missing keys, values of the wrong type or
/// outside their limits, blocks of one row or sum that bear the same name, a text longer than kMaxChainText bytes,
/// nested deeper than kMaxChainDepth or of more than kMaxChainBlocks blocks.
AnyBlock parse(std::string_view text, const Registry& registry = standard_registry());

/// The text form of a block. parse(to_text(b)) has the same text and behaviour as b, with parameters and state in the
/// same order; a block that is no Series comes back as a Series of one.
///
/// Numbers read back bit for bit. A block without kind() is written `custom` and cannot be read back. Throws Error when
/// a label is not a name, and for chains beyond the limits above.
std::string to_text(const AnyBlock& block);

/// The block as one primary of the grammar, a Series in parentheses: what a block writes in its arguments() for a block
/// nested in it.
std::string to_nested_text(const AnyBlock& block);

}  // namespace blockid
