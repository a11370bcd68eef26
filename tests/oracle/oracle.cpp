#include "oracle.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <unsupported/Eigen/AutoDiff>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace oracle {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double const alpha_max = 0.99;

// Direction (x, y, z) of the ray through an image point before the lens, by fixed-point iteration on the forward model.
Vector3d camera_direction(gart::camera const& c, double u, double v) {
  double const xd = (u - double(c.cx)) / double(c.fx), yd = (v - double(c.cy)) / double(c.fy);
  double const k1 = c.lens.k1, k2 = c.lens.k2, p1 = c.lens.p1, p2 = c.lens.p2;
  double x = xd, y = yd;
  for (int step = 0; step < 2000; ++step) {
    double const r2 = x * x + y * y, radial = 1 + k1 * r2 + k2 * r2 * r2;
    double const tx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x), ty = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    double const ex = x * radial + tx - xd, ey = y * radial + ty - yd;
    if (std::abs(ex) + std::abs(ey) < 1e-14) return {x, y, 1};
    x = (xd - tx) / radial, y = (yd - ty) / radial;
  }
  throw std::runtime_error("oracle: this lens cannot be inverted at this pixel; use a weaker distortion");
}

Vector3d world_direction(gart::camera const& c, int i, int j) {
  Matrix3d r;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) r(row, column) = c.rotation[column][row];
  return (r * camera_direction(c, i + 0.5, j + 0.5)).normalized();
}

// The real spherical harmonics up to degree 3 in the order and signs of splat files.
void harmonics(Vector3d const& d, double y[16]) {
  double const a = d.x(), b = d.y(), c = d.z();
  y[0] = 0.28209479177387814;
  y[1] = -0.4886025119029199 * b;
  y[2] = 0.4886025119029199 * c;
  y[3] = -0.4886025119029199 * a;
  y[4] = 1.0925484305920792 * a * b;
  y[5] = -1.0925484305920792 * b * c;
  y[6] = 0.31539156525252005 * (2 * c * c - a * a - b * b);
  y[7] = -1.0925484305920792 * a * c;
  y[8] = 0.5462742152960396 * (a * a - b * b);
  y[9] = -0.5900435899266435 * b * (3 * a * a - b * b);
  y[10] = 2.890611442640554 * a * b * c;
  y[11] = -0.4570457994644658 * b * (4 * c * c - a * a - b * b);
  y[12] = 0.3731763325901154 * c * (2 * c * c - 3 * a * a - 3 * b * b);
  y[13] = -0.4570457994644658 * a * (4 * c * c - a * a - b * b);
  y[14] = 1.445305721320277 * c * (a * a - b * b);
  y[15] = -0.5900435899266435 * a * (a * a - 3 * b * b);
}

template <class S>
Eigen::Matrix<S, 3, 3> rotation_of(S w, S x, S y, S z) {
  S const norm = sqrt(S(w * w + x * x + y * y + z * z));
  w /= norm, x /= norm, y /= norm, z /= norm;
  Eigen::Matrix<S, 3, 3> r;
  r << S(1 - 2 * (y * y + z * z)), S(2 * (x * y - w * z)), S(2 * (x * z + w * y)),  //
      S(2 * (x * y + w * z)), S(1 - 2 * (x * x + z * z)), S(2 * (y * z - w * x)),   //
      S(2 * (x * z - w * y)), S(2 * (y * z + w * x)), S(1 - 2 * (x * x + y * y));
  return r;
}

// What the filter of a camera's pixels makes of a Gaussian.
class pixels_filter {
 public:
  pixels_filter(gart::camera const& c, double pixels, Matrix3d const& turn = Matrix3d::Identity())
      : c_(c), pixels_(pixels), turn_(turn) {
    for (int k = 0; pixels > 0 && k <= 64; ++k) {
      double const u = k / 64.0 * c.width, v = k / 64.0 * c.height;
      for (Vector3d const& p : {camera_direction(c, u, 0), camera_direction(c, u, c.height), camera_direction(c, 0, v),
                                camera_direction(c, c.width, v)})
        lo_ = lo_.cwiseMin(p), hi_ = hi_.cwiseMax(p);
    }
  }

  // By covariances: every s^2 grows by that of the filter, and sigma falls by the area that the plane across the view
  // sees. `scale` and `sigma` are changed in place; `to_mean` is the mean as the camera has it.
  template <class S>
  void widen(Eigen::Matrix<S, 3, 1> const& to_mean, Eigen::Matrix<S, 3, 3> const& r, Eigen::Matrix<S, 3, 1>& scale,
             S& sigma) const {
    using std::sqrt;
    if (!(pixels_ > 0)) return;
    S const angle = angle_at(to_mean);
    S distance2(0.0);
    for (int a = 0; a < 3; ++a) distance2 += S(to_mean[a] * to_mean[a]);
    S const variance = pixels_ * pixels_ * angle * distance2;
    S before(0.0), after(0.0);  // d^T C^-1 d, times |mean|^2
    for (int k = 0; k < 3; ++k) {
      S along(0.0);
      for (int a = 0; a < 3; ++a) along += S(r(a, k) * to_mean[a]);
      S const square = scale[k] * scale[k], wide = square + variance;
      before += S(along * along / square), after += S(along * along / wide);
    }
    S area = before / after;
    for (int k = 0; k < 3; ++k) {
      S const square = scale[k] * scale[k], wide = square + variance;
      area *= S(square / wide), scale[k] = sqrt(wide);
    }
    sigma *= S(sqrt(area));
  }

 private:
  // The solid angle of a pixel towards `p`: of the parallelogram by which the unit direction moves with the image
  // point.
  template <class S>
  S angle_at(Eigen::Matrix<S, 3, 1> const& p) const {
    using std::sqrt;
    Eigen::Matrix<S, 3, 1> q;
    for (int axis = 0; axis < 3; ++axis) {
      q[axis] = S(0.0);
      Vector3d const turned = turn_ * Vector3d(c_.rotation[axis][0], c_.rotation[axis][1], c_.rotation[axis][2]);
      for (int k = 0; k < 3; ++k) q[axis] += S(p[k] * turned[k]);
    }
    S const x = inside(q[0], q[2], lo_[0], hi_[0]), y = inside(q[1], q[2], lo_[1], hi_[1]);
    S const squares = 1.0 + x * x + y * y, length = sqrt(squares);
    S const n[3] = {S(x / length), S(y / length), S(1.0 / length)};
    S by_x[3], by_y[3];
    for (int k = 0; k < 3; ++k) {
      by_x[k] = S(S((k == 0 ? 1.0 : 0.0) - n[k] * n[0]) / length);
      by_y[k] = S(S((k == 1 ? 1.0 : 0.0) - n[k] * n[1]) / length);
    }
    S cross2(0.0);
    for (int k = 0; k < 3; ++k) {
      S const side = by_x[(k + 1) % 3] * by_y[(k + 2) % 3] - by_x[(k + 2) % 3] * by_y[(k + 1) % 3];
      cross2 += S(side * side);
    }
    double const k1 = c_.lens.k1, k2 = c_.lens.k2, p1 = c_.lens.p1, p2 = c_.lens.p2;
    S const r2 = x * x + y * y, radial = 1.0 + k1 * r2 + k2 * r2 * r2, slope = 2 * k1 + 4 * k2 * r2;
    S const uu = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x, uv = slope * x * y + 2 * p1 * x + 2 * p2 * y;
    S const vv = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x;
    return sqrt(cross2) / (double(c_.fx) * double(c_.fy) * (uu * vv - uv * uv));
  }
  template <class S>
  static S inside(S const& side, S const& z, double lo, double hi) {
    if (!(z > 0.0)) return S(side < 0.0 ? lo : hi);
    S const slope = side / z;
    return slope < lo ? S(lo) : slope > hi ? S(hi) : slope;
  }

  gart::camera const& c_;
  double pixels_;
  Matrix3d turn_;  // of the camera in the world
  Vector3d lo_ = Vector3d::Constant(1e300), hi_ = Vector3d::Constant(-1e300);
};

struct prepared {
  Vector3d from_mean;  // o - mean
  Matrix3d to_unit;    // S^-1 R^T
  double sigma;
  Vector3d from_middle;  // to_unit from_mean
  double far;            // farther from the mean, in squares of units, a response is less than half of what counts
};

std::vector<prepared> prepare(parameters const& m, Vector3d const& origin, pixels_filter const& filter,
                              double alpha_min) {
  using std::sqrt;
  std::vector<prepared> out(m.size());
  for (std::size_t i = 0; i < m.size(); ++i) {
    double const* q = &m.quaternion[4 * i];
    Matrix3d const r = rotation_of(q[0], q[1], q[2], q[3]);
    Vector3d scale = Vector3d(m.log_scale[3 * i], m.log_scale[3 * i + 1], m.log_scale[3 * i + 2]).array().exp();
    out[i].from_mean = origin - Vector3d(m.mean[3 * i], m.mean[3 * i + 1], m.mean[3 * i + 2]);
    out[i].sigma = 1 / (1 + std::exp(-m.opacity[i]));
    filter.widen<double>(-out[i].from_mean, r, scale, out[i].sigma);
    out[i].to_unit = scale.cwiseInverse().asDiagonal() * r.transpose();
    out[i].from_middle = out[i].to_unit * out[i].from_mean;
    out[i].far = 9.001 * std::pow(std::log(2 * out[i].sigma / alpha_min) / 4.5, 2.0 / m.kernel_degree);
  }
  return out;
}

// Rounding of a float ray and of a float S^-1 R^T: a few units in the last place of each product.
double const ulps = 3 * std::ldexp(1.0, -24);
double const alpha_ulps = 1e-6;      // exp, sigmoid and their product, relative
double const decision_slack = 1e-5;  // and what a decision on alpha or T is given beyond that, relative

std::vector<hit> hits_of(std::vector<prepared> const& gaussians, int kernel_degree, Vector3d const& d,
                         gart::render_options const& options) {
  std::vector<hit> list;
  double const alpha_min = options.alpha_min, near = options.near;
  double const n = kernel_degree;
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    prepared const& g = gaussians[i];
    Vector3d const &o_g = g.from_middle, d_g = g.to_unit * d;
    double const t = -o_g.dot(d_g) / d_g.squaredNorm();
    Vector3d const p = o_g + t * d_g;
    if (p.squaredNorm() > g.far) continue;  // most are, and their powers would take most of the time
    double const radius = p.norm();
    double const response = g.sigma * std::exp(-4.5 * std::pow(radius / 3, n));
    if (response < 0.5 * alpha_min) continue;

    // An element of the rotation near 0 is a difference of products near 1, and off by their roundings.
    Matrix3d const magnitude = 0.5 * (g.to_unit.cwiseAbs().colwise() + g.to_unit.rowwise().norm());
    Vector3d const o_error = ulps * (magnitude * g.from_mean.cwiseAbs()), d_error = ulps * (magnitude * d.cwiseAbs());
    hit h;
    h.t = t, h.id = static_cast<std::uint32_t>(i);
    h.alpha = std::min(alpha_max, response);
    // t sums what alpha's p has seen cancel, with a matrix that is itself a few units off.
    h.t_slack = 1e-7 * std::abs(t) +
                3 * (o_error.dot(d_g.cwiseAbs()) + d_error.dot(o_g.cwiseAbs() + 2 * std::abs(t) * d_g.cwiseAbs())) /
                    d_g.squaredNorm();
    // The relative slope of the response, 1.5 n (r / 3)^(n - 1), times what p may be off by along itself.
    Vector3d const p_error = o_error + std::abs(t) * d_error;
    double const along = radius > 0 ? p.cwiseAbs().dot(p_error) / radius : p_error.norm();
    h.alpha_slack = alpha_ulps + 1.5 * n * std::pow(radius / 3, n - 1) * along;
    // Towards the cusp of degree 1 the direction of the gradient is lost, and with it its sign.
    h.at_cusp = kernel_degree == 1 && radius < 1e3 * p_error.norm();
    h.at_clamp = std::abs(response / alpha_max - 1) < h.alpha_slack;
    h.clamps = response > alpha_max ? 8u : 0u;
    h.marginal = std::abs(response - alpha_min) <= (decision_slack + h.alpha_slack) * alpha_min ||
                 std::abs(t - near) <= h.t_slack;
    h.counted = h.alpha >= alpha_min && t > near;
    if (h.counted || (h.marginal && t > near - h.t_slack)) list.push_back(h);
  }
  std::sort(list.begin(), list.end(),
            [](hit const& a, hit const& b) { return a.t < b.t || (a.t == b.t && a.id < b.id); });
  return list;
}

struct shaded {
  Vector3d color;
  unsigned clamps;
  bool kink;
};

shaded shade(parameters const& m, std::uint32_t id, double const y[16], int active_degree) {
  std::size_t const all = std::size_t(m.sh_degree + 1) * (m.sh_degree + 1),
                    active = std::size_t(active_degree + 1) * (active_degree + 1);
  double const* sh = &m.sh[3 * all * id];
  shaded s{Vector3d::Constant(0.5), 0, false};
  for (std::size_t k = 0; k < active; ++k) s.color += y[k] * Vector3d(sh[3 * k], sh[3 * k + 1], sh[3 * k + 2]);
  for (int c = 0; c < 3; ++c) {
    s.kink |= std::abs(s.color[c]) < 4e-6;
    if (s.color[c] <= 0) s.clamps |= 1u << c, s.color[c] = 0;
  }
  return s;
}

// The hits of one ray that count, with what compositing front to back gives each.
struct step {
  hit h;
  Vector3d color;
  double transmittance;  // before it
  Vector3d behind;       // the colour of all that follows, background included, seen with T = 1
  double clear_behind;   // the transmittance of all that follows
  double depth_behind;   // the depth of all that follows, seen with T = 1
};

// Hits past the end of the ray are cut from `list`.
std::vector<step> composite(parameters const& m, std::vector<hit>& list, double const y[16], int active_degree,
                            gart::render_options const& options, pixel& out) {
  std::vector<step> steps;
  double const t_min = options.transmittance_min;
  Vector3d const background(options.background[0], options.background[1], options.background[2]);
  std::uint32_t composited = 0;
  double transmittance = 1, relative_error = 0, brightest = std::max(1.0, background.maxCoeff());
  std::size_t end = 0;
  for (; end < list.size(); ++end) {
    hit& h = list[end];
    shaded const s = shade(m, h.id, y, active_degree);
    h.clamps |= s.clamps;
    steps.push_back({h, s.color, transmittance, Vector3d::Zero(), 0, 0});
    brightest = std::max(brightest, s.color.maxCoeff());
    out.edge |= h.marginal;
    out.kink |= s.kink || h.at_cusp || h.at_clamp;
    if (!h.counted) continue;
    transmittance *= 1 - h.alpha;
    relative_error += h.alpha / (1 - h.alpha) * h.alpha_slack;
    if (t_min > 0 && std::abs(transmittance / t_min - 1) < decision_slack + relative_error) {
      out.edge = true;
      out.rounding += transmittance * brightest;
    }
    ++composited;
    if (transmittance < t_min || composited == options.max_hits) {
      ++end;
      break;
    }
  }
  // Equal in every bit is the same geometry twice, ordered by id in any arithmetic: no tie.
  auto const tied = [](hit const& a, hit const& b) { return a.t != b.t && b.t - a.t <= a.t_slack + b.t_slack; };
  // Where the last hit may trade places with a neighbour, the ray may end one hit sooner or later.
  bool const capped = options.max_hits != 0 && composited == options.max_hits;
  bool const ended = transmittance < t_min || capped;
  bool const trades = ended && ((end > 1 && tied(list[end - 2], list[end - 1])) ||
                                (end < list.size() && tied(list[end - 1], list[end])));
  out.edge |= trades;
  // Which hit is the last one is then not decided, however opaque it is; nor at a cap where some hit is not.
  if (trades || (capped && out.edge)) out.rounding += steps.back().transmittance * brightest;
  list.resize(end);
  out.transmittance = transmittance;
  Vector3d behind = background;
  double clear_behind = 1, depth_behind = 0;
  double alpha_rounding = 0, clear_rounding = 0, slope_squared = 0;  // sums of squares: roundings are independent
  for (std::size_t i = steps.size(); i-- > 0;) {
    step& s = steps[i];
    s.behind = behind, s.clear_behind = clear_behind, s.depth_behind = depth_behind;
    double const weight = s.transmittance * s.h.alpha;
    double const contrast = weight * (s.color - behind).cwiseAbs().maxCoeff();
    slope_squared += contrast * contrast;
    if (s.h.marginal)
      out.rounding += contrast;
    else
      alpha_rounding += contrast * contrast * s.h.alpha_slack * s.h.alpha_slack;
    if (!s.h.counted) continue;
    bool const held = (s.h.clamps & 8u) != 0 && !s.h.at_clamp;
    double const cleared = held ? 0 : weight * s.h.alpha_slack * clear_behind;
    clear_rounding += cleared * cleared;
    behind = s.h.alpha * s.color + (1 - s.h.alpha) * behind;
    clear_behind *= 1 - s.h.alpha;
    depth_behind = s.h.alpha * s.h.t + (1 - s.h.alpha) * depth_behind;
    out.depth += weight * s.h.t;
    ++out.hits;
  }
  out.rounding += std::sqrt(alpha_rounding);
  out.transmittance_rounding = std::sqrt(clear_rounding);
  for (int c = 0; c < 3; ++c) out.color[c] = behind[c];

  double widest = 0, exchanged_squared = 0;
  for (step const& s : steps) widest = std::max(widest, s.h.t_slack);
  // What a hit's own gradient may lose or gain by trading places with others. Those of one geometry (equal in every bit
  // of t) trade together, the rest each on its own.
  for (std::size_t i = 0; i < steps.size(); ++i) {
    step const& a = steps[i];
    Vector3d together = Vector3d::Zero();
    double last_t = a.h.t;
    auto const trade = [&](step const& b, double transmittance) {
      if (!tied(a.h, b.h)) return 0.0;
      Vector3d const exchanged = (a.color - b.color) * (transmittance * a.h.alpha * b.h.alpha);
      if (b.h.t != last_t) {
        double const all = together.cwiseAbs().maxCoeff();
        exchanged_squared += all * all;
        together.setZero(), last_t = b.h.t;
      }
      together += exchanged;
      return exchanged.cwiseAbs().maxCoeff();
    };
    for (std::size_t j = i; j-- > 0 && a.h.t - steps[j].h.t <= a.h.t_slack + widest;)
      trade(steps[j], steps[j].transmittance);
    for (std::size_t j = i + 1; j < steps.size() && steps[j].h.t - a.h.t <= a.h.t_slack + widest; ++j)
      out.rounding += trade(steps[j], a.transmittance);
    double const all = together.cwiseAbs().maxCoeff();
    exchanged_squared += all * all;
  }
  out.slope_rounding = exchanged_squared > 0 ? std::sqrt(exchanged_squared / slope_squared) : 0;
  steps.erase(std::remove_if(steps.begin(), steps.end(), [](step const& s) { return !s.h.counted; }), steps.end());
  return steps;
}

// alpha below its clamp, t, and their derivatives by mean, log-scale, quaternion and opacity, by forward
// differentiation of the definition.
using dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 11, 1>>;

struct dual_hit {
  dual alpha, t;
};

dual_hit response_of(parameters const& m, std::size_t i, Vector3d const& origin, Vector3d const& d,
                     pixels_filter const& filter) {
  using Vector = Eigen::Matrix<dual, 3, 1>;
  Vector mean, scale;
  for (int a = 0; a < 3; ++a) {
    mean[a] = dual(m.mean[3 * i + a], 11, a);
    scale[a] = exp(dual(m.log_scale[3 * i + a], 11, 3 + a));
  }
  double const* q = &m.quaternion[4 * i];
  auto const r = rotation_of<dual>(dual(q[0], 11, 6), dual(q[1], 11, 7), dual(q[2], 11, 8), dual(q[3], 11, 9));
  dual sigma = 1.0 / (1.0 + exp(dual(-dual(m.opacity[i], 11, 10))));
  Vector to_mean, o_g, d_g;
  for (int a = 0; a < 3; ++a) to_mean[a] = mean[a] - origin[a];
  filter.widen<dual>(to_mean, r, scale, sigma);
  for (int a = 0; a < 3; ++a) {
    o_g[a] = dual(0.0), d_g[a] = dual(0.0);
    for (int b = 0; b < 3; ++b) {
      o_g[a] += dual(r(b, a) * (origin[b] - mean[b]));
      d_g[a] += dual(r(b, a) * d[b]);
    }
    o_g[a] /= scale[a], d_g[a] /= scale[a];
  }
  dual od(0.0), dd(0.0), pp(0.0);
  for (int a = 0; a < 3; ++a) od += dual(o_g[a] * d_g[a]), dd += dual(d_g[a] * d_g[a]);
  dual const t = -od / dd;
  for (int a = 0; a < 3; ++a) {
    dual const p = o_g[a] + t * d_g[a];
    pp += dual(p * p);
  }
  // |p|^n as a power of |p|^2; at its centre the response has no slope, or for degree 1 none that has a direction.
  if (pp.value() == 0) return {sigma, t};
  return {sigma * exp(dual(-4.5 * pow(dual(pp / 9.0), 0.5 * m.kernel_degree))), t};
}

void check_degree(parameters const& m, int active_degree) {
  if (active_degree < 0 || active_degree > m.sh_degree || m.sh_degree > 3)
    throw std::invalid_argument("oracle: active_degree must lie in [0, the model's degree], and that in [0, 3]");
}

Vector3d origin_of(gart::camera const& c) { return {c.position[0], c.position[1], c.position[2]}; }

}  // namespace

parameters::parameters(gart::gaussian_model const& m)
    : sh_degree(m.sh_degree),
      mean(m.mean.begin(), m.mean.end()),
      log_scale(m.log_scale.begin(), m.log_scale.end()),
      quaternion(m.quaternion.begin(), m.quaternion.end()),
      opacity(m.opacity.begin(), m.opacity.end()),
      sh(m.sh.begin(), m.sh.end()) {}

direction ray_through(gart::camera const& c, int i, int j) {
  Vector3d const d = world_direction(c, i, j);
  return {d.x(), d.y(), d.z()};
}

picture render(parameters const& m, gart::camera const& c, gart::render_options const& options, int active_degree,
               motion const& by) {
  check_degree(m, active_degree);
  Vector3d const w(by.turn[0], by.turn[1], by.turn[2]);
  Matrix3d turn = Matrix3d::Identity();
  if (w.norm() > 0) turn = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  Vector3d const origin = origin_of(c) + Vector3d(by.shift[0], by.shift[1], by.shift[2]);
  auto const gaussians = prepare(m, origin, pixels_filter(c, options.antialias, turn), options.alpha_min);
  picture out{c.width, c.height, std::vector<pixel>(std::size_t(c.width) * c.height)};
  for (int j = 0; j < c.height; ++j)
    for (int i = 0; i < c.width; ++i) {
      pixel& p = out.pixels[std::size_t(j) * c.width + i];
      Vector3d const d = turn * world_direction(c, i, j);
      double y[16];
      harmonics(d, y);
      p.list = hits_of(gaussians, m.kernel_degree, d, options);
      composite(m, p.list, y, active_degree, options, p);
    }
  return out;
}

parameters gradients(parameters const& m, gart::camera const& c, gart::render_options const& options, int active_degree,
                     std::vector<double> const& color_gradient, std::vector<double> const& transmittance_gradient,
                     std::vector<double> const& depth_gradient) {
  check_degree(m, active_degree);
  std::size_t const pixels = std::size_t(c.width) * c.height;
  if (color_gradient.size() != 3 * pixels ||
      (!transmittance_gradient.empty() && transmittance_gradient.size() != pixels) ||
      (!depth_gradient.empty() && depth_gradient.size() != pixels))
    throw std::invalid_argument("oracle: a gradient image must have the size of the camera's image");
  parameters g = m;
  for (auto* group : {&g.mean, &g.log_scale, &g.quaternion, &g.opacity, &g.sh})
    std::fill(group->begin(), group->end(), 0.0);
  std::size_t const all = std::size_t(m.sh_degree + 1) * (m.sh_degree + 1),
                    active = std::size_t(active_degree + 1) * (active_degree + 1);

  Vector3d const origin = origin_of(c);
  pixels_filter const filter(c, options.antialias);
  auto const gaussians = prepare(m, origin, filter, options.alpha_min);
  for (std::size_t at = 0; at < pixels; ++at) {
    Vector3d const by_color(color_gradient[3 * at], color_gradient[3 * at + 1], color_gradient[3 * at + 2]);
    double const by_transmittance = transmittance_gradient.empty() ? 0.0 : transmittance_gradient[at];
    double const by_depth = depth_gradient.empty() ? 0.0 : depth_gradient[at];
    if (by_color.isZero(0) && by_transmittance == 0 && by_depth == 0) continue;
    Vector3d const d = world_direction(c, int(at % c.width), int(at / c.width));
    double y[16];
    harmonics(d, y);
    pixel ignored;
    auto list = hits_of(gaussians, m.kernel_degree, d, options);
    for (step const& s : composite(m, list, y, active_degree, options, ignored)) {
      std::size_t const i = s.h.id;
      double const weight = s.transmittance * s.h.alpha;
      for (int channel = 0; channel < 3; ++channel)
        if (!(s.h.clamps >> channel & 1))
          for (std::size_t k = 0; k < active; ++k)
            g.sh[3 * (all * i + k) + channel] += by_color[channel] * weight * y[k];
      bool const held = (s.h.clamps & 8) != 0;
      if (held && by_depth == 0) continue;
      double const by_alpha = s.transmittance * (by_color.dot(s.color - s.behind) - by_transmittance * s.clear_behind +
                                                 by_depth * (s.h.t - s.depth_behind));
      dual_hit const h = response_of(m, i, origin, d, filter);
      auto const slope =
          ((held ? 0.0 : by_alpha) * h.alpha.derivatives() + by_depth * weight * h.t.derivatives()).eval();
      for (int a = 0; a < 3; ++a) g.mean[3 * i + a] += slope[a], g.log_scale[3 * i + a] += slope[3 + a];
      for (int a = 0; a < 4; ++a) g.quaternion[4 * i + a] += slope[6 + a];
      g.opacity[i] += slope[10];
    }
  }
  return g;
}

}  // namespace oracle
