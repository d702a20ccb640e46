#include <cstdlib>
#include <string>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/verify.hpp"

using namespace panelgate::audit;

/// Any file is judged, and only a chain passes: what passes is made again of its bodies.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Verifier verifier;
    verifier.begin_file("x");
    std::string again;
    Chain chain;
    Anchors anchors;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        const std::string_view line = text.substr(at, end == text.npos ? end : end - at);
        collect_anchor(line, anchors);
        if (const auto record = parse_line(line)) chain.append(again, record->body);
        if (!verifier.take(line, end != text.npos)) break;
        at = end == text.npos ? text.size() : end + 1;
    }
    const Report report = verifier.finish();
    const Tail tail = parse_tail(text);
    if (report.fault) {
        if (report.fault->text.empty()) std::abort();
    } else if (report.first == 1) {
        if (again != text || tail.last != report.last || !tail.torn.empty()) std::abort();
    }
    return 0;
}
