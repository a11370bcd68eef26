#pragma once
// Records of a file that cannot be used: left out, counted and said, with the fault of the first. A file that has no
// other is refused.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>
#include <gart/core/words.hpp>

#include <string>
#include <vector>

namespace gart::io {

class unusable {
 public:
  // A record by its number, more than once or not; what() is asked for the first alone.
  template <class F>
  void add(std::size_t record, F const& what) {
    if (!records_.empty() && records_.back() == record) return;
    if (records_.empty()) first_ = what();
    records_.push_back(record);
  }
  std::vector<std::size_t> const& records() const { return records_; }
  std::string const& first() const { return first_; }

  // The usable ones of `all` records, by their numbers; a note of the others if `notes` is not null.
  std::vector<u32> others(std::size_t all, char const* noun, std::string const& file,
                          std::vector<std::string>* notes) const {
    std::vector<char> out(all, 0);
    std::size_t n = 0;
    for (std::size_t const i : records_) n += !out[i], out[i] = 1;
    if (all > 0 && n == all)
      throw io_error(file, first_ + (all > 1 ? ", and no " + std::string(noun) + " is without such a fault" : ""),
                     "correct it where it was made, and export it again");
    std::vector<u32> kept;
    kept.reserve(all - n);
    for (std::size_t i = 0; i < all; ++i)
      if (!out[i]) kept.push_back(static_cast<u32>(i));
    if (n && notes)
      notes->push_back(counted(n, noun) + " of " + file + " left out: " + (n > 1 ? "first, " : "") + first_);
    return kept;
  }

 private:
  std::vector<std::size_t> records_;
  std::string first_;
};

}  // namespace gart::io
