#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chart {

/// A step of a ladder: its name, and the changes to a scenario that take it.
struct KnobRung {
  std::string name;
  std::vector<std::string> sets;  ///< as for --set
};

/// One thing that can be chosen, from cheap to exact as far as there is an order.
struct Knob {
  std::string name;
  std::vector<KnobRung> rungs;
  std::size_t standard = 0;       ///< the rung that a scenario has that says nothing
  std::vector<std::string> with;  ///< without these the knob has no effect
};
/// All that the charts turn. Models of motion are not here: they say where the target is, not how
/// it looks (`starloop orbits` charts these); nor is the Poisson method, which has one exact rung.
[[nodiscard]] const std::vector<Knob>& all_knobs();

/// A choice of a rung for each knob.
struct Setting {
  std::string name;                ///< "standard", "bounces=2", "mix 7"
  std::string knob;                ///< the one that is turned; empty: none, or all
  std::vector<std::size_t> rungs;  ///< by knob
  std::vector<std::string> sets;
};

/// As the scenario has it: what the program chooses by itself.
[[nodiscard]] Setting standard_setting();
/// Each knob's other rungs, one at a time.
[[nodiscard]] std::vector<Setting> single_settings();
/// Rungs of all knobs together: a Latin hypercube (McKay, Beckman & Conover 1979,
/// DOI 10.1080/00401706.1979.10489755), so that each rung of a knob is taken as often as any other,
/// but for one. The same for the same seed.
[[nodiscard]] std::vector<Setting> mixed_settings(std::size_t count, std::uint64_t seed);
/// What the program can do at its best, by so many samples a pixel.
[[nodiscard]] Setting reference_setting(int samples_per_pixel);

}  // namespace chart
