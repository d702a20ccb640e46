#pragma once

#include <string>

namespace panelgate {

/// A number as people write it: the shortest decimal that reads back as the same number. Whole
/// numbers have no point ("3"), zero no sign; an exponent only from 1e16 on and below 0.0001.
/// "" for what is not finite.
std::string number_text(double value);
/// Of a float its own digits: "0.1", where number_text(double) of it tells 0.10000000149011612.
std::string number_text(float value);

/// The double that is nearest to what a float prints: 0.1 of 0.1F.
double as_printed(float value);

}  // namespace panelgate
