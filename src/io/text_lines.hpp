#pragma once
// Reads a text file by lines, with or without a byte order mark, and with any line ends. It counts lines for errors. A
// record is a line: unread rests of a line are refused.

#include "bytes.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gart::io {

class text_lines {
 public:
  explicit text_lines(std::filesystem::path const& path) : file_(path.string()), bytes_(read_file(path)) {
    rest_ = std::string_view(reinterpret_cast<char const*>(bytes_.data()), bytes_.size());
    if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
    if (rest_.starts_with("\xff\xfe") || rest_.starts_with("\xfe\xff"))
      throw io_error(file_, "is text of 16-bit characters", "save it as UTF-8");
    if (rest_.find('\n') == rest_.npos) end_ = '\r';
  }
  // The next line that is neither blank nor a comment.
  bool next_record() {
    while (next())
      if (!is_blank() && !is_comment()) return true;
    return false;
  }
  bool next() {
    if (rest_.empty()) return false;
    std::size_t const end = rest_.find(end_);
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    return ++number_;
  }
  // The line after this one, not yet taken; empty at the end.
  std::string_view ahead() const { return rest_.substr(0, rest_.find(end_)); }
  bool is_blank() const {
    std::string_view probe = line_;
    return next_word(probe).empty();
  }
  bool is_comment() const {
    std::string_view probe = line_;
    return next_word(probe).starts_with('#');
  }

  std::string_view word(char const* field) {
    std::string_view const w = next_word(line_);
    if (w.empty()) refuse(std::string(field) + " is missing");
    return w;
  }
  template <class T>
  T number(char const* field) {
    std::string_view const w = word(field);
    T value{};
    if (!parse_number(w, value))
      refuse(std::string(field) + " is '" + std::string(w.substr(0, 40)) + "', not a number in range");
    return value;
  }
  std::string rest_of_line(char const* field) {
    while (!line_.empty() && is_space(line_.front())) line_.remove_prefix(1);
    while (!line_.empty() && is_space(line_.back())) line_.remove_suffix(1);
    if (line_.empty()) refuse(std::string(field) + " is missing");
    return std::string(line_);
  }
  // Nothing is left of the line; `record` says what ends here.
  void end(std::string const& record) {
    std::string_view const w = next_word(line_);
    if (!w.empty())
      refuse(record + " is followed by '" + std::string(w.substr(0, 40)) + "'",
             "take out what follows, or export the file again");
  }
  [[noreturn]] void refuse(std::string const& what,
                           std::string const& remedy = "the file is truncated or damaged: export it again") const {
    throw io_error(file_ + ", line " + std::to_string(number_), what, remedy);
  }

 private:
  std::string file_;
  std::vector<u8> bytes_;
  std::string_view rest_, line_;
  std::size_t number_ = 0;
  char end_ = '\n';
};

}  // namespace gart::io
