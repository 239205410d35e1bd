// SPDX-License-Identifier: MIT
#include "ftcs/experiment/run_figures.h"

#include <algorithm>

namespace ftcs::experiment {
namespace {

constexpr FigureName kFigures[] = {
    {"rms_time_error", "rms_time_error_ns", &RunFigures::rms_time_error_ns, true},
    {"max_time_error", "max_time_error_ns", &RunFigures::max_time_error_ns, true},
    {"mean_time_error", "mean_time_error_ns", &RunFigures::mean_time_error_ns, true},
    {"rms_perceived_offset", "rms_perceived_offset_ns", &RunFigures::rms_perceived_offset_ns, true},
    {"rms_first_ten", "rms_first_ten_ns", &RunFigures::rms_first_ten_ns, true},
    {"c5_cycles", "c5_cycles", &RunFigures::c5_cycles, false},
    {"rate_error_ppb", "rate_error_ppb", &RunFigures::rate_error_ppb, false},
    {"event_cycles", "event_cycles", &RunFigures::event_cycles, false},
    {"event_max", "event_max_ns", &RunFigures::event_max_ns, true},
    {"event_overshoot", "event_overshoot_ns", &RunFigures::event_overshoot_ns, true},
    {"within_1_sigma", "within_1_sigma", &RunFigures::within_1_sigma, false},
    {"within_2_sigma", "within_2_sigma", &RunFigures::within_2_sigma, false},
    {"within_3_sigma", "within_3_sigma", &RunFigures::within_3_sigma, false},
    {"steps", "steps", &RunFigures::steps, false},
    {"backward_steps", "backward_steps", &RunFigures::backward_steps, false},
    {"rejected", "rejected", &RunFigures::rejected, false},
    {"holdovers", "holdovers", &RunFigures::holdovers, false},
};

}  // namespace

std::span<const FigureName> figure_names() noexcept { return kFigures; }

const FigureName* find_figure(std::string_view name) noexcept {
  const auto* found = std::find_if(std::begin(kFigures), std::end(kFigures),
                                   [&](const FigureName& f) { return f.name == name; });
  return found == std::end(kFigures) ? nullptr : found;
}

}  // namespace ftcs::experiment
