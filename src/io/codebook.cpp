#include "codebook.hpp"

#include "bulk.hpp"
#include "packing.hpp"

#include <cmath>
#include <numeric>
#include <queue>

namespace gart::io {

namespace {

constexpr double codebook_reach = 8;
constexpr int moves = 24;          // of a codebook's numbers
constexpr int rounds = 4;          // of a palette's means
constexpr double most_work = 8e9;  // of a round: multiplications, about a second

struct bin {
  double count = 0, sum = 0;
};

// A set of rows, [first, last) of the order, and what halving it is worth.
struct row_set {
  std::size_t first, last, column;
  double error;
  float middle;
  bool operator<(row_set const& b) const { return error < b.error; }
};

class palette_maker {
 public:
  palette_maker(std::vector<float> const& rows, std::vector<float> const& weights, std::size_t width)
      : rows_(rows), weights_(weights), width_(width), n_(rows.size() / width), order_(n_), starts_{0} {
    std::iota(order_.begin(), order_.end(), 0u);
    p_.width = width, p_.of.resize(n_);
  }

  palette make(std::size_t count) {
    halve(count);
    to_means();
    for (int round = 0; round < rounds; ++round) to_nearest(), to_means();
    double sum = 0, size = 0;
    for (std::size_t i = 0; i < n_; ++i) {
      double squares = 0;
      for (std::size_t c = 0; c < width_; ++c) {
        double const d = static_cast<double>(rows_[i * width_ + c] - p_.rows[p_.of[i] * width_ + c]);
        squares += d * d;
      }
      sum += static_cast<double>(weights_[i]) * squares;
      size += static_cast<double>(weights_[i]) * static_cast<double>(width_);
    }
    p_.error = sum / size;
    return std::move(p_);
  }

 private:
  // Sets that were one when there were as many as branches are wanted.
  struct branch {
    std::size_t first, last;  // of the order
    std::size_t row, count;   // of the palette
  };

  row_set measured(std::size_t first, std::size_t last) const {
    std::vector<double> sum(width_), squares(width_);
    double size = 0;
    for (std::size_t i = first; i < last; ++i) {
      double const weight = static_cast<double>(weights_[order_[i]]);
      size += weight;
      for (std::size_t c = 0; c < width_; ++c) {
        double const v = static_cast<double>(rows_[order_[i] * width_ + c]);
        sum[c] += weight * v, squares[c] += weight * v * v;
      }
    }
    row_set s{first, last, 0, 0, 0};
    double widest = -1;
    for (std::size_t c = 0; c < width_; ++c) {
      double const error = squares[c] - sum[c] * sum[c] / size;
      s.error += error;
      if (error > widest) widest = error, s.column = c, s.middle = static_cast<float>(sum[c] / size);
    }
    return s;
  }

  void halve(std::size_t count) {
    double const work = static_cast<double>(n_) * static_cast<double>(count * width_);
    std::priority_queue<row_set> sets;
    std::vector<row_set> done;
    sets.push(measured(0, n_));
    while (!sets.empty() && sets.size() + done.size() < count) {
      row_set const s = sets.top();
      sets.pop();
      auto const middle = std::partition(order_.begin() + static_cast<std::ptrdiff_t>(s.first),
                                         order_.begin() + static_cast<std::ptrdiff_t>(s.last),
                                         [&](u32 i) { return rows_[i * width_ + s.column] < s.middle; });
      std::size_t const at = static_cast<std::size_t>(middle - order_.begin());
      if (at == s.first || at == s.last) {
        done.push_back(s);  // all alike
        continue;
      }
      if (work > most_work * static_cast<double>(starts_.size())) starts_.push_back(at);
      sets.push(measured(s.first, at));
      sets.push(measured(at, s.last));
    }
    for (; !sets.empty(); sets.pop()) done.push_back(sets.top());

    std::sort(done.begin(), done.end(), [](row_set const& a, row_set const& b) { return a.first < b.first; });
    std::sort(starts_.begin(), starts_.end());
    for (std::size_t k = 0, next = 0; k < done.size(); ++k) {
      if (next < starts_.size() && done[k].first == starts_[next]) {
        ++next;
        branches_.push_back({done[k].first, done[k].first, k, 0});
      }
      branches_.back().last = done[k].last, ++branches_.back().count;
      for (std::size_t i = done[k].first; i < done[k].last; ++i) p_.of[order_[i]] = static_cast<u32>(k);
    }
    p_.rows.resize(done.size() * width_);
  }

  void to_means() {
    std::vector<double> sum(p_.rows.size()), size(p_.count());
    for (std::size_t i = 0; i < n_; ++i) {
      double const weight = static_cast<double>(weights_[i]);
      size[p_.of[i]] += weight;
      for (std::size_t c = 0; c < width_; ++c)
        sum[p_.of[i] * width_ + c] += weight * static_cast<double>(rows_[i * width_ + c]);
    }
    for (std::size_t k = 0; k < p_.count(); ++k)
      for (std::size_t c = 0; size[k] > 0 && c < width_; ++c)
        p_.rows[k * width_ + c] = static_cast<float>(sum[k * width_ + c] / size[k]);
  }

  void to_nearest() {
    // A branch's rows by columns, so that a compiler takes several rows at once.
    std::vector<float> columns(p_.rows.size());
    std::size_t most = 0;
    for (branch const& b : branches_) {
      most = std::max(most, b.count);
      for (std::size_t k = 0; k < b.count; ++k)
        for (std::size_t c = 0; c < width_; ++c)
          columns[b.row * width_ + c * b.count + k] = p_.rows[(b.row + k) * width_ + c];
    }
    in_parts(n_, [&](std::size_t first, std::size_t last) {
      std::vector<float> distances(most);
      float* const d = distances.data();
      for (branch const& b : branches_) {
        for (std::size_t at = std::max(first, b.first); at < std::min(last, b.last); ++at) {
          u32 const i = order_[at];
          std::fill(d, d + b.count, 0.0f);
          for (std::size_t c = 0; c < width_; ++c) {
            float const x = rows_[i * width_ + c];
            float const* const column = &columns[b.row * width_ + c * b.count];
            for (std::size_t k = 0; k < b.count; ++k) d[k] += (x - column[k]) * (x - column[k]);
          }
          p_.of[i] = static_cast<u32>(b.row + static_cast<std::size_t>(std::min_element(d, d + b.count) - d));
        }
      }
    });
  }

  std::vector<float> const& rows_;
  std::vector<float> const& weights_;
  std::size_t const width_, n_;
  std::vector<u32> order_;
  std::vector<std::size_t> starts_;  // of the branches
  std::vector<branch> branches_;
  palette p_;
};

}  // namespace

codebook::codebook(std::vector<float> const& values) {
  if (values.empty()) return;
  auto const [least, most] = bulk_range(values, codebook_reach);
  double const low = static_cast<double>(least), size = static_cast<double>(most) - low;
  std::vector<bin> bins(16384);
  for (float const v : values) {
    double const inside = static_cast<double>(std::clamp(v, least, most));
    double const at = size > 0 ? (inside - low) / size * static_cast<double>(bins.size()) : 0;
    bin& b = bins[std::min(bins.size() - 1, static_cast<std::size_t>(at))];
    ++b.count, b.sum += inside;
  }
  double all = 0;
  for (bin const& b : bins) all += std::cbrt(b.count);
  std::array<double, 256> at{};
  double seen = 0;
  std::size_t next = 0;
  for (bin const& b : bins) {
    seen += std::cbrt(b.count);
    while (next < at.size() && b.count > 0 && seen >= all * (static_cast<double>(next) + 0.5) / 256)
      at[next++] = b.sum / b.count;
  }
  while (next < at.size()) at[next++] = static_cast<double>(most);
  for (int move = 0; move < moves; ++move) {
    std::array<bin, 256> nearest_to{};
    std::size_t k = 0;
    for (bin const& b : bins) {
      if (b.count == 0) continue;
      while (k + 1 < at.size() && b.sum / b.count > (at[k] + at[k + 1]) / 2) ++k;
      nearest_to[k].count += b.count, nearest_to[k].sum += b.sum;
    }
    for (std::size_t i = 0; i < at.size(); ++i)
      if (nearest_to[i].count > 0) at[i] = nearest_to[i].sum / nearest_to[i].count;
  }
  std::sort(at.begin(), at.end());
  std::transform(at.begin(), at.end(), numbers_.begin(), [](double v) { return static_cast<float>(v); });
}

u8 codebook::nearest(float value) const {
  auto const above = std::lower_bound(numbers_.begin(), numbers_.end(), value);
  if (above == numbers_.begin()) return 0;
  if (above == numbers_.end()) return 255;
  auto const below = above - 1;
  return static_cast<u8>((value - *below <= *above - value ? below : above) - numbers_.begin());
}

codebook codebook::even(std::vector<float> const& values, double step) {
  codebook c({});
  if (values.empty()) return c;
  auto const [least, most] = bulk_range(values, codebook_reach);
  double const first = std::floor(static_cast<double>(least) / step + 0.5),
               last = std::floor(static_cast<double>(most) / step + 0.5);
  if (!(last - first < 256)) return codebook(values);
  for (std::size_t i = 0; i < c.numbers_.size(); ++i)
    c.numbers_[i] = static_cast<float>(std::min(last, first + static_cast<double>(i)) * step);
  return c;
}

palette shared_rows(std::vector<float> const& rows, std::vector<float> const& weights, std::size_t width,
                    std::size_t count) {
  return width && !rows.empty() ? palette_maker(rows, weights, width).make(count) : palette{width, {}, {}};
}

}  // namespace gart::io
