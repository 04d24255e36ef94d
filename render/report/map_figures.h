#pragma once
/// Maps of a scene over two settings, from a sweep that ran all their combinations.

#include "render/report/figures.h"

namespace substep::report {

/// Draws a panel for each scene and algorithm that ran several n with several steps.
Sheet step_map_sheet(const FigureSource& source);
/// Draws a panel for each scene and algorithm that ran several τ with several κ, for joints and contacts
/// alike.
Sheet factor_map_sheet(const FigureSource& source);

}  // namespace substep::report
