#include "accept.hpp"

#include <algorithm>
#include <charconv>

namespace panelgate::web {
namespace {

std::string_view trimmed(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return text;
}

/// Cuts off what comes before the separator; the rest stays in `text`.
std::string_view next(std::string_view& text, char separator) {
    const auto at = std::min(text.find(separator), text.size());
    const std::string_view part = text.substr(0, at);
    text.remove_prefix(std::min(at + 1, text.size()));
    return trimmed(part);
}

/// The weight among these parameters; 1 when there is none.
double weight_of(std::string_view parameters) {
    while (!parameters.empty()) {
        const std::string_view one = next(parameters, ';');
        if (!one.starts_with("q=") && !one.starts_with("Q=")) continue;
        double weight = 0;
        std::from_chars(one.data() + 2, one.data() + one.size(), weight);
        return weight;
    }
    return 1;
}

}  // namespace

bool prefers(std::string_view accept, std::string_view type) {
    double wanted = 0;
    double other = 0;
    while (!accept.empty()) {
        std::string_view item = next(accept, ',');
        const std::string_view one = next(item, ';');
        const double weight = weight_of(item);
        if (one == type) wanted = weight;
        if (one == "application/json") other = weight;
    }
    return wanted > 0 && wanted >= other;
}

}  // namespace panelgate::web
