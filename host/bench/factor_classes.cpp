#include "host/bench/factor_classes.hpp"

namespace birdseye::host {

std::span<const FactorClass> factor_classes() {
  // Of poses: what the demo calls typical; the miniBIRD's noise of a record, and what thirty stations in that noise
  // leave of hand-eye (docs/manual/calibrate-hand-eye.md).
  static const std::vector<FactorClass> classes{
      {"elastic", {}},
      {"nothing moved", {"--no-deformation"}},
      {"bezier 3", {"--dof", "3"}},
      {"bezier 81", {"--dof", "81"}},
      {"bend", {"--deformation", "bend"}},
      {"push", {"--deformation", "push", "--amplitude-mm", "12", "--push-width-mm", "40"}},
      {"compression", {"--deformation", "compression"}},
      {"twist", {"--deformation", "twist"}},
      {"breathing", {"--deformation", "breathing"}},
      {"pneumoperitoneum", {"--deformation", "pneumoperitoneum"}},
      {"elastic 5 mm", {"--amplitude-mm", "5"}},
      {"elastic 20 mm", {"--amplitude-mm", "20"}},
      {"2 views", {"--views", "2"}},
      {"3 views", {"--views", "3"}},
      {"4 views", {"--views", "4"}},
      {"7 views", {"--views", "7"}},
      {"9 views", {"--views", "9"}},
      {"lamp 40 mm", {"--light-offset-mm", "40"}},
      {"lamp 90 mm", {"--light-offset-mm", "90"}},
      {"texture none", {"--texture", "0"}},
      {"texture 0.3", {"--texture", "0.3"}},
      {"wet 3", {"--wet", "3"}},
      {"blood 0.3", {"--blood", "0.3"}},
      {"wet and bloody", {"--wet", "3", "--blood", "0.3"}},
      {"instrument", {"--instruments", "1"}},
      {"3 instruments", {"--instruments", "3"}},
      {"blur 1 px", {"--blur-px", "1"}},
      {"blur 2 px", {"--blur-px", "2"}},
      {"noise 4", {"--noise", "4"}},
      {"poses typical", {"--pose-noise-mm", "0.5", "--pose-noise-deg", "0.1"}},
      {"poses miniBIRD", {"--pose-noise-mm", "1.8", "--pose-noise-deg", "0.5"}},
      {"hand-eye", {"--pose-offset-mm", "1.1", "--pose-offset-deg", "0.21"}},
      {"typical and hand-eye",
       {"--pose-noise-mm", "0.5", "--pose-noise-deg", "0.1", "--pose-offset-mm", "1.1", "--pose-offset-deg", "0.21"}},
      {"miniBIRD and hand-eye",
       {"--pose-noise-mm", "1.8", "--pose-noise-deg", "0.5", "--pose-offset-mm", "1.1", "--pose-offset-deg", "0.21"}}};
  return classes;
}

}  // namespace birdseye::host
