#include "host/registration/views/held_out_gain.hpp"

#include <cmath>
#include <numeric>

#include "host/registration/views/view_problem.hpp"

namespace birdseye::host {

bool HeldOutGain::nothing_moved() const {
  // Where the views are at odds with one another, as by wrong poses, their gains scatter and tell nothing.
  constexpr double kSure_nats = 0.01;
  return nats < kWorthwhile && standard_error_nats < kSure_nats;
}

Result<HeldOutGain> gain_on_held_out_views(const std::vector<VideoView>& views, const Tissue& tissue,
                                           const ControlGrid& control, const Headlight& light,
                                           const Headlight& light_of_none, const ViewRegistrationSettings& settings,
                                           ViewRegistration& record) {
  // Of three views a half would leave one to fit to.
  const std::size_t parts = views.size() == 3 ? 3 : 2;
  const std::vector<double> none(control.parameters(), 0.0);
  // A record of how the result was reached has no place for fits to some of the views.
  const std::vector<TracePoint> trace = record.trace;
  std::vector<double> gains;
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<VideoView> fitted, held_out;
    for (std::size_t n = 0; n < views.size(); ++n) (n % parts == part ? held_out : fitted).push_back(views[n]);
    auto fit = ViewProblem::make(fitted, tissue, control, kCoarse, settings.prior, record, settings.watch);
    if (!fit) return fit.error();
    auto judge = ViewProblem::make(held_out, tissue, control, kCoarse, settings.prior, record, settings.watch);
    if (!judge) return judge.error();
    const std::vector<double> found = fit->climb(none, light, kCoarse.most_steps);
    judge->similarity(found, light);
    const std::vector<double> with = judge->views().per_view();
    judge->similarity(none, light_of_none);
    for (std::size_t n = 0; n < with.size(); ++n) gains.push_back(with[n] - judge->views().per_view()[n]);
  }
  record.trace = trace;
  const auto count = static_cast<double>(gains.size());
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / count;
  double squares = 0;
  for (const double gain : gains) squares += std::pow(gain - mean, 2);
  return HeldOutGain{mean, std::sqrt(squares / (count - 1) / count)};
}

}  // namespace birdseye::host
