#pragma once

#include "calibration/base/verdict.hpp"
#include "host/demo/demo_report.hpp"

namespace birdseye::host {

/// What the demo's figures are worth: the worst of their limits, the tumour's error first. Whatever the errors, it
/// fails where nothing was overlaid and where views were kept and no deformation was found. Each reason begins with the
/// grade that it stands for; the first is of the tumour's error also where that passes.
Verdict demo_verdict(const DemoFigures& figures);

}  // namespace birdseye::host
