#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/verify.hpp"

using namespace panelgate::audit;

/// Any file is judged, and only a chain passes: what passes is made again of its bodies.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const int file = ::memfd_create("audit", 0);
    static const std::string name = "/proc/self/fd/" + std::to_string(file);
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    if (::ftruncate(file, 0) != 0 || ::pwrite(file, data, size, 0) < 0) std::abort();
    std::string again;
    Chain chain;
    Anchors anchors;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        const std::string_view line = text.substr(at, end == text.npos ? end : end - at);
        collect_anchor(line, anchors);
        if (const auto record = parse_line(line)) chain.append(again, record->body);
        at = end == text.npos ? text.size() : end + 1;
    }
    const Report report = verify({name});
    const Tail tail = parse_tail(text);
    if (!report.unread.empty()) std::abort();
    if (report.fault) {
        if (report.fault->text.empty()) std::abort();
    } else if (report.first == 1) {
        if (again != text || tail.last != report.last || !tail.torn.empty()) std::abort();
    }
    return 0;
}
