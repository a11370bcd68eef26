#pragma once
/// \file
/// Everything that is safe in any host translation unit, in four parts. io.hpp and runtime.hpp serve programs that use
/// compiled configurations, in half the compile time of templates.hpp; view.hpp is the viewer.

#include <gart/io.hpp>
#include <gart/runtime.hpp>
#include <gart/templates.hpp>
#include <gart/view.hpp>
