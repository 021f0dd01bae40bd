#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockid {

/// A rectangle of numbers with a name for each column.
struct Table {
  std::vector<std::string> names;  ///< one a column; "1", "2", ... when the text has no header
  Eigen::MatrixXd values;          ///< (rows, columns)
  std::string source;              ///< file name or whatever messages should call it
  bool has_header = false;
};

struct CsvOptions {
  /// ',' ';' '\t' or any other character; ' ' stands for runs of blanks and tabs. Found from the
  /// text when not given.
  std::optional<char> separator;
  /// Whether the first line holds names. When not given: yes if no cell of it is a number.
  std::optional<bool> header;
  /// Reads empty cells and NaN as NaN instead of refusing them. Infinities are always refused.
  bool allow_missing = false;
};

/// Reads a table from text.
///
/// Blank lines and lines beginning with # or % are skipped; lines end in LF, CRLF or CR; a byte
/// order mark is skipped. Cells may be quoted with ". Numbers have a decimal point, an optional
/// sign and exponent, independent of the locale. Separator not given: the first of ; , tab that
/// occurs in the first data line, else white space; tabs mixed with blanks, or at the end of a line
/// (as in DaISy files), are white space.
/// @throws Error "source:line: column c: ..." for ragged rows, cells that are no number, non-finite
/// samples (with their
///   zero-based index), unterminated quotes; also for text without data and for binary content.
[[nodiscard]] Table parse_csv(std::string_view text, std::string_view source_name, const CsvOptions& options = {});

/// parse_csv of a file's content.
[[nodiscard]] Table read_csv(const std::filesystem::path& path, const CsvOptions& options = {});

/// One column, (rows,).
/// @param name_or_number a column name, else a 1-based column number
/// @throws Error that lists the columns when there is no such column; when a name occurs twice.
[[nodiscard]] Eigen::VectorXd column(const Table& table, std::string_view name_or_number);

/// Zero-based position of that column; same parameters and errors as column.
[[nodiscard]] Eigen::Index column_index(const Table& table, std::string_view name_or_number);

/// Comma-separated text from which parse_csv gets the same values bit for bit (shortest round-trip
/// decimals). NaN is written as "nan" and needs allow_missing to be read again. The header is
/// written when has_header is set.
/// @throws Error when names and columns differ in number or a name contains a line break.
[[nodiscard]] std::string to_csv(const Table& table);

/// Writes to_csv(table), replacing the file atomically.
void write_csv(const std::filesystem::path& path, const Table& table);

}  // namespace blockid
