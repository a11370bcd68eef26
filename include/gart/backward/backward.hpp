#pragma once
/// \file
/// From the gradient of an image to the gradients of the parameters, by any method (backward/gradient_methods.hpp):
///
///   backward_pass<frame<E, Traits, Tracer>, primitive_method> pass(exec);
///   frame.prepare(scene, view, options);
///   pass.prepare(frame);                                       // footprints, lists and hit buffer, where it records
///   pass.render(frame, {.color = color});                      // the forward pass, with what the method records
///   differentiate(frame, pass, color_gradient, gradients);     // overwrites `gradients`
///
/// By with_depth<primitive_method> the gradient is of the image's depth and transmittance too:
///   pass.render(frame, {.color = color, .transmittance = transmittance, .depth = depth});
///   differentiate(frame, pass, {color_gradient, depth_gradient}, gradients);
///
/// A pass remembers which preparation of which frame it follows. Out of this order it throws invalid_argument. Where
/// memory is short, backward/fallback.hpp takes a method that needs less.
///
/// Memory beside the gradients: 48 bytes a Gaussian for the moments. A method that records also needs the hit buffer: 4
/// or 16 bytes for each pixel of each box (4 more with depth). Where the tracer has no lists to lend, footprints take
/// 36 bytes a Gaussian and lists 8 a (primitive, tile) pair.

#include <gart/backward/finish.hpp>
#include <gart/backward/gather_form.hpp>
#include <gart/backward/gradient_methods.hpp>
#include <gart/backward/scatter.hpp>
#include <gart/render/frame.hpp>
#include <gart/tiles/tile_map.hpp>

#include <string>

namespace gart { inline namespace GART_ISA {

/// dL/d an image: [H][W][3] by colour, and where wanted [H][W] by depth and by transmittance.
struct image_gradients {
  span<float const> color;               ///< [H][W][3]
  span<float const> depth = {};          ///< [H][W], or empty: zero
  span<float const> transmittance = {};  ///< [H][W], or empty: zero
};

/// The backward pass of one frame by one method.
template <class Frame, gradient_method Method>
class backward_pass {
 public:
  using frame_type = Frame;                                         ///< whose images it differentiates
  using method_type = Method;                                       ///< how
  using execution_type = typename Frame::execution_type;            ///< the policy
  static constexpr int sh_degree = Frame::sh_degree;                ///< of the coefficients that are stored
  static constexpr int tile_size = Frame::tile_size;                ///< side of a tile, in pixels
  using record_type = typename Method::template record<tile_size>;  ///< what the forward pass leaves of a hit
  static constexpr bool records = Method::gather::any;              ///< whether it leaves anything
  static constexpr bool ordered = records && Method::ordered;    ///< sums in a fixed order: the same bits in every run
  static constexpr slot_validity validity = Method::validity;    ///< how slots of hits are recognised
  static constexpr bool of_depth = has_depth<Method>;            ///< whether depth has a gradient
  static constexpr bool records_depths = Method::gather::depth;  ///< whether the forward pass leaves a depth a hit

  /// Allocates nothing; `exec` must outlive it.
  explicit backward_pass(execution_type& exec)
      : moments_(exec), own_footprints_(exec), map_(exec), slots_(exec), rows_(exec), last_(exec), depths_(exec) {}

  /// After the frame's preparation: a tracer that has the view's footprints lends them. Returns false and allocates
  /// nothing where the hit buffer would exceed byte_budget (0: no limit). The same where its slots are more than 32
  /// bits can number.
  [[nodiscard]] bool prepare(Frame const& frame, u64 byte_budget = 0) {
    stands_at_ = nothing, frame_ = &frame, preparation_ = frame.preparation();
    if constexpr (records) {
      using tracer_type = typename Frame::tracer_type;
      execution_type& exec = frame.exec();
      auto const& view = frame.view();
      grid_ = {view.width, view.height};
      if constexpr (tracer_type::lends_footprints) {
        static_assert(footprint_tracer<tracer_type, execution_type>);
        footprints_ = &frame.tracer().footprints();
      } else {
        own_footprints_.template measure<typename Frame::response>(exec, frame.seen(), view, frame.options().alpha_min,
                                                                   frame.options().near, frame.options().rows);
        footprints_ = &own_footprints_;
      }
      if (byte_budget && footprints_->slots() * slot_bytes > byte_budget) return false;
      if (footprints_->slots() >= tile_slots::none) return false;
      if constexpr (tracer_type::lends_footprints) {
        lists_ = frame.tracer().map();
      } else {
        visit_camera(view, [&](auto const& model) {
          map_.build(exec, grid_, *footprints_, number_order{}, pair_test_of(model, frame.gaussians().data()));
        });
        lists_ = map_.view();
      }
      slots_.resize(footprints_->slots());
      if constexpr (records_depths) depths_.resize(footprints_->slots());
      if constexpr (validity == slot_validity::recomputed) {
        last_.resize(static_cast<std::size_t>(view.width) * view.height);
      } else {
        stage_scope stage(exec, "clear");
        exec.fill(slots_.data(), 0xff, slots_.size() * sizeof(entry));  // a NaN: not written
      }
    }
    stands_at_ = prepared;
    return true;
  }

  /// The forward pass, with the record of the method; `targets.last` belongs to the pass. The colour is read again by
  /// differentiate(), and so are depth and transmittance where there is a gradient by them.
  void render(Frame& frame, image_targets targets) {
    require(frame, prepared, "backward_pass.render: call backward_pass.prepare first, after frame.prepare");
    record_type record{};
    if constexpr (records) {
      record = {footprints_->ranges().data(), slots_.data()};
      if constexpr (records_depths) record.depths = depths_.data();
      if constexpr (validity == slot_validity::recomputed) targets.last = last_.data();
    }
    frame.render(targets, record);
    color_ = targets.color, stands_at_ = rendered;
    depth_.depth = targets.depth, depth_.transmittance = targets.transmittance;
  }

  /// The moments of the last differentiate(), [N][moment_stride]. Where pixels had errors, error_place holds the error
  /// seen through each Gaussian.
  span<float const> moments() const { return moments_; }
  /// The same, for gradients of other channels to be added to before finish_gradients.
  span<float> moments() { return moments_; }
  /// After differentiate(), by a method with sums in a fixed order: the summed rows, pair_gradient<sh_degree>::quads
  /// for each (primitive, tile) pair. Those of primitive i begin at pair_offsets()[i].
  span<quad const> pair_rows() const requires ordered { return rows_; }
  /// The boxes, cut to what was traced.
  span<footprint_slots const> ranges() const requires ordered { return footprints_->ranges(); }
  /// Where the rows of each primitive begin.
  span<u64 const> pair_offsets() const requires ordered { return footprints_->pair_offsets(); }

  /// Bytes of the hit buffer for the view last prepared; 0 where the method records nothing.
  std::size_t hit_buffer_bytes() const { return records ? slots_.size() * slot_bytes : 0; }

  /// The error to throw when prepare() returns false without a budget.
  out_of_memory out_of_memory_error() const {
    u64 const slots = footprints_ ? footprints_->slots() : 0;
    return out_of_memory("hit buffer", slots * slot_bytes, 0,
                         std::to_string(slots) +
                             " slots, and there are numbers for 2^32: render smaller, with fewer Gaussians, or take "
                             "configuration_request.backward = pixel, which needs none");
  }

  /// What sum_gradients() calls: all but what finish_gradients (backward/finish.hpp) does.
  void sum(Frame& frame, image_gradients const& image, gaussians_view<float> gradients, span<float const> error) {
    using response = typename Frame::response;
    require(frame, rendered, "differentiate: call backward_pass.render first, after frame.prepare");
    execution_type& exec = frame.exec();
    gaussians_view<float const> const scene = frame.scene();
    auto const& view = frame.view();
    std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
    if (!color_) throw invalid_argument("differentiate needs the image's colour: give backward_pass.render its target");
    if (image.color.size() != 3 * pixels)
      throw invalid_argument("differentiate: the image's gradient must have three values for each pixel of the view");
    take_depth(image, pixels);
    if (!error.empty() && error.size() != pixels)
      throw invalid_argument("differentiate: the error must have a value for each pixel of the view");
    if (gradients.count != scene.count || gradients.sh_degree != sh_degree)
      throw invalid_argument("differentiate: the gradients must have the number and the SH degree of the Gaussians");
    moments_.resize(std::size_t{moment_stride} * scene.count);
    // The ordered sums write every Gaussian themselves.
    if constexpr (!(ordered && Method::gather::geometry)) moments_.zero();
    if constexpr (!(ordered && Method::gather::color))
      exec.zero(gradients.sh, sizeof(float) * scene.count * static_cast<std::size_t>(gradients.sh_stride()));
    if constexpr (records) {
      if constexpr (ordered) {
        rows_.resize(footprints_->pairs() * pair_gradient<sh_degree>::quads);
        rows_.zero();  // pairs in no list have no sums
      }
      gather(frame, image.color, error, gradients);
      if constexpr (ordered)
        parallel_for(exec, "backward/sum", scene.count * pair_gradient<sh_degree>::quads,
                     sum_pairs<sh_degree, typename Method::gather>{footprints_->pair_offsets(), footprints_->pairs(),
                                                                   rows_.data(), gradients.sh, moments_.data()});
    }
    if constexpr (Method::scatter::any) {
      pixel_order const order{view.width, view.height, frame.options().rows};
      frame.with_rays([&]<class Rays>(Rays const& rays) {
        frame.trace("backward/scatter", order.launch_size(),
                    scatter_program<sh_degree, response, typename Method::scatter, execution_type, Rays>{
                        {},
                        rays,
                        order,
                        scene.sh,
                        frame.active_degree(),
                        frame.options().transmittance_min,
                        frame.options().max_hits,
                        frame.gaussians().data(),
                        color_,
                        image.color.data(),
                        error.data(),
                        gradients.sh,
                        moments_.data(),
                        depth_});
      });
    }
  }

 private:
  using entry = typename record_type::entry;
  static constexpr std::size_t slot_bytes = sizeof(entry) + (records_depths ? sizeof(float) : 0);
  enum standing { nothing, prepared, rendered };

  void require(Frame const& frame, standing least, char const* what) const {
    if (stands_at_ < least || frame_ != &frame || preparation_ != frame.preparation()) throw invalid_argument(what);
  }

  // The gradients by depth and transmittance, where there are any.
  void take_depth(image_gradients const& image, std::size_t pixels) {
    for (span<float const> const& one : {image.depth, image.transmittance}) {
      if (one.empty()) continue;
      if (!of_depth)
        throw invalid_argument("differentiate: the method has no gradient of depth: take with_depth<method>");
      if (one.size() != pixels)
        throw invalid_argument("differentiate: a gradient by depth or transmittance must have a value for each pixel");
    }
    if constexpr (of_depth) {
      if ((!image.depth.empty() && !depth_.depth) || (!image.transmittance.empty() && !depth_.transmittance))
        throw invalid_argument(
            "differentiate needs the image's depth or transmittance: give backward_pass.render its target");
      depth_.slots = depths_.data();
      depth_.depth_gradient = image.depth.data(), depth_.transmittance_gradient = image.transmittance.data();
    }
  }

  void gather(Frame const& frame, span<float const> color_gradient, span<float const> error,
              gaussians_view<float> gradients) {
    frame.with_rays([&]<class Rays>(Rays const& rays) {
      using kernel =
          gather_of<method_gather<execution_type, sh_degree, typename Frame::response, Method, tile_size, Rays>>;
      parallel_for(
          frame.exec(), "backward/gather", tile_range{grid_.count(), kernel::block_size},
          kernel{rays, grid_, lists_, footprints_->ranges().data(), slots_.data(), frame.gaussians().data(),
                 frame.active_degree(), color_, color_gradient.data(), error.data(), gradients.sh, moments_.data(),
                 footprints_->pair_offsets().data(), rows_.data(), last_.data(), frame.options().near, depth_});
    });
  }

  Frame const* frame_ = nullptr;
  u64 preparation_ = 0;
  standing stands_at_ = nothing;
  float const* color_ = nullptr;
  buffer<float, execution_type> moments_;
  footprints<execution_type, tile_size> own_footprints_;
  footprints<execution_type, tile_size> const* footprints_ = nullptr;
  tile_grid<tile_size> grid_;
  tile_map<execution_type, tile_size> map_;
  tile_map_view lists_;
  buffer<entry, execution_type> slots_;
  buffer<quad, execution_type> rows_;
  buffer<last_hit, execution_type> last_;
  buffer<float, execution_type> depths_;
  depth_image depth_;
};

/// Turns the gradients of the image that the pass rendered into those of the scene's parameters, without the pixels'
/// filter. Given an error a pixel, [H][W], it also attributes the errors to the Gaussians (backward_pass.moments). A
/// Gaussian's sum over its hits is of weight times error.
template <class Frame, gradient_method Method>
void differentiate(Frame& frame, backward_pass<Frame, Method>& pass, image_gradients const& image,
                   gaussians_view<float> gradients, span<float const> error = {}) {
  stage_scope stage(frame.exec(), "backward");
  pass.sum(frame, image, gradients, error);
  finish_gradients(frame.exec(), frame.scene(), frame.gaussians(), frame.view(), frame.options().antialias,
                   pass.moments(), gradients);
}

/// The first part of it: gradients.sh, and pass.moments(), from which finish_gradients (backward/finish.hpp) makes the
/// other gradients. Both are sums over pixels, which ranks that trace parts of an image add up in between.
template <class Frame, gradient_method Method>
void sum_gradients(Frame& frame, backward_pass<Frame, Method>& pass, image_gradients const& image,
                   gaussians_view<float> gradients, span<float const> error = {}) {
  stage_scope stage(frame.exec(), "backward");
  pass.sum(frame, image, gradients, error);
}

/// The same by colour alone, [H][W][3].
template <class Frame, gradient_method Method>
void differentiate(Frame& frame, backward_pass<Frame, Method>& pass, span<float const> color_gradient,
                   gaussians_view<float> gradients, span<float const> error = {}) {
  differentiate(frame, pass, image_gradients{color_gradient}, gradients, error);
}

///@{
/// The same into Gaussians that own their memory.
template <class Frame, gradient_method Method>
void differentiate(Frame& frame, backward_pass<Frame, Method>& pass, image_gradients const& image,
                   gaussians<typename Frame::execution_type>& gradients, span<float const> error = {}) {
  differentiate(frame, pass, image, gradients.view(), error);
}
template <class Frame, gradient_method Method>
void differentiate(Frame& frame, backward_pass<Frame, Method>& pass, span<float const> color_gradient,
                   gaussians<typename Frame::execution_type>& gradients, span<float const> error = {}) {
  differentiate(frame, pass, color_gradient, gradients.view(), error);
}
///@}

}}  // namespace gart::GART_ISA
