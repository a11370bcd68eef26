#include "codebook.hpp"

#include "packing.hpp"

#include <limits>
#include <numeric>
#include <queue>

namespace gart::io {

namespace {

constexpr int moves = 24;           // of a codebook's numbers
constexpr int rounds = 4;           // of a palette's means
constexpr double most_work = 2e10;  // of a round: multiplications

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

}  // namespace

codebook::codebook(std::vector<float> const& values) {
  if (values.empty()) return;
  auto const [least, most] = std::minmax_element(values.begin(), values.end());
  double const low = static_cast<double>(*least), size = static_cast<double>(*most) - low;
  std::vector<bin> bins(16384);
  for (float const v : values) {
    double const at = size > 0 ? (static_cast<double>(v) - low) / size * static_cast<double>(bins.size()) : 0;
    bin& b = bins[std::min(bins.size() - 1, static_cast<std::size_t>(at))];
    ++b.count, b.sum += static_cast<double>(v);
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
  while (next < at.size()) at[next++] = static_cast<double>(*most);
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

palette shared_rows(std::vector<float> const& rows, std::vector<float> const& weights, std::size_t width,
                    std::size_t count) {
  palette p;
  p.width = width;
  std::size_t const n = width ? rows.size() / width : 0;
  if (n == 0) return p;
  std::vector<u32> order(n);
  std::iota(order.begin(), order.end(), 0u);
  auto const measured = [&](std::size_t first, std::size_t last) {
    std::vector<double> sum(width), squares(width);
    double size = 0;
    for (std::size_t i = first; i < last; ++i) {
      double const weight = static_cast<double>(weights[order[i]]);
      size += weight;
      for (std::size_t c = 0; c < width; ++c) {
        double const v = static_cast<double>(rows[order[i] * width + c]);
        sum[c] += weight * v, squares[c] += weight * v * v;
      }
    }
    row_set s{first, last, 0, 0, 0};
    double widest = -1;
    for (std::size_t c = 0; c < width; ++c) {
      double const error = squares[c] - sum[c] * sum[c] / size;
      s.error += error;
      if (error > widest) widest = error, s.column = c, s.middle = static_cast<float>(sum[c] / size);
    }
    return s;
  };
  std::priority_queue<row_set> sets;
  std::vector<row_set> done;
  sets.push(measured(0, n));
  while (!sets.empty() && sets.size() + done.size() < count) {
    row_set const s = sets.top();
    sets.pop();
    auto const middle = std::partition(order.begin() + static_cast<std::ptrdiff_t>(s.first),
                                       order.begin() + static_cast<std::ptrdiff_t>(s.last),
                                       [&](u32 i) { return rows[i * width + s.column] < s.middle; });
    std::size_t const at = static_cast<std::size_t>(middle - order.begin());
    if (at == s.first || at == s.last) {
      done.push_back(s);  // all alike
      continue;
    }
    sets.push(measured(s.first, at));
    sets.push(measured(at, s.last));
  }
  for (; !sets.empty(); sets.pop()) done.push_back(sets.top());

  p.of.resize(n);
  for (std::size_t k = 0; k < done.size(); ++k)
    for (std::size_t i = done[k].first; i < done[k].last; ++i) p.of[order[i]] = static_cast<u32>(k);
  p.rows.resize(done.size() * width);
  auto const to_means = [&] {
    std::vector<double> sum(p.rows.size()), size(p.count());
    for (std::size_t i = 0; i < n; ++i) {
      double const weight = static_cast<double>(weights[i]);
      size[p.of[i]] += weight;
      for (std::size_t c = 0; c < width; ++c)
        sum[p.of[i] * width + c] += weight * static_cast<double>(rows[i * width + c]);
    }
    for (std::size_t k = 0; k < p.count(); ++k)
      for (std::size_t c = 0; size[k] > 0 && c < width; ++c)
        p.rows[k * width + c] = static_cast<float>(sum[k * width + c] / size[k]);
  };
  to_means();
  double const work = static_cast<double>(n) * static_cast<double>(p.rows.size());
  for (int round = 0; round < rounds && work <= most_work; ++round) {
    in_parts(n, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        float least = std::numeric_limits<float>::infinity();
        for (std::size_t k = 0; k < p.count(); ++k) {
          float distance = 0;
          for (std::size_t c = 0; c < width; ++c) {
            float const d = rows[i * width + c] - p.rows[k * width + c];
            distance += d * d;
          }
          if (distance < least) least = distance, p.of[i] = static_cast<u32>(k);
        }
      }
    });
    to_means();
  }
  return p;
}

}  // namespace gart::io
