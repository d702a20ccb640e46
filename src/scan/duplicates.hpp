#pragma once

#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

/// Decides, with all stations known, which addresses two stations share and whether the line is
/// noisy instead: damage at one address among good ones is a collision, damage everywhere is not.
void tell_duplicates(Result& result);

}  // namespace panelgate::scan
