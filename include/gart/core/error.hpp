#pragma once
/// \file
/// The errors gart throws. Each message says what was wrong, where, and what to do. The types let a program react
/// without reading the text. A setting is named by its field, `struct.field`. ` = value` follows where the remedy is a
/// value: "raise dataset_options.downscale", "use configuration_request.backend = openmp". A program whose settings
/// have other names replaces them in the messages it shows (program/field_names.hpp).

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace gart {

struct error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file that cannot be read or written as asked. `where` is the path, with the field or line where one is known.
struct io_error : error {
  /// The message names place, cause and remedy.
  io_error(std::string where, std::string const& what, std::string advice = {})
      : error(where + ": " + what + (advice.empty() ? "" : " (" + advice + ")")),
        place(std::move(where)),
        remedy(std::move(advice)) {}
  std::string place,  ///< the path, with the field or line
      remedy;         ///< what to do, or empty
};

/// A request that this build or machine cannot serve: a camera model, a backend, a configuration that is not compiled.
struct unsupported : error {
  using error::error;
};

/// An option or argument out of its range.
struct invalid_argument : error {
  using error::error;
};

/// Memory that could not be had. `advice` names the fields that lower the need. 0 free bytes: free memory was not the
/// reason.
struct out_of_memory : error {
  /// In bytes; `where` is whose memory, "host" for one.
  out_of_memory(std::string const& where, std::size_t asked_bytes, std::size_t free_bytes, std::string const& advice)
      : error("out of " + where + " memory: asked for " + std::to_string(asked_bytes) + " bytes" +
              (free_bytes ? ", " + std::to_string(free_bytes) + " bytes free" : "") + " (" + advice + ")"),
        asked(asked_bytes),
        available(free_bytes) {}
  std::size_t asked, available;  ///< bytes
};

/// A number of a training that is not finite any more (optim/finite.hpp). `group` as the message names it.
struct not_finite : error {
  /// `first` is the first Gaussian that has one.
  not_finite(std::string const& what, std::string group_name, std::size_t first)
      : error(what), group(std::move(group_name)), gaussian(first) {}
  std::string group;     ///< as in the message
  std::size_t gaussian;  ///< its number
};

}  // namespace gart
