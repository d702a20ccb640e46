#include "panelgate/metrics/process.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

namespace panelgate::metrics {
namespace {

std::string read_text(const char* path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::optional<double> boot_time() {
    std::ifstream in("/proc/stat");
    for (std::string line; std::getline(in, line);) {
        double seconds = 0;
        std::istringstream fields(line);
        if (std::string key; fields >> key >> seconds && key == "btime") return seconds;
    }
    return std::nullopt;
}

std::optional<double> count_open_fds() {
    std::error_code error;
    std::filesystem::directory_iterator entry("/proc/self/fd", error);
    double count = 0;
    while (!error && entry != std::filesystem::directory_iterator()) {
        ++count;
        entry.increment(error);
    }
    if (error) return std::nullopt;
    return count - 1;  // minus the descriptor of the directory itself
}

std::optional<double> max_fds() {
    rlimit limit{};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return std::nullopt;
    return static_cast<double>(limit.rlim_cur);
}

}  // namespace

ProcessFacts parse_stat(std::string_view stat, const ProcUnits& units) {
    const auto name_end = stat.rfind(')');
    if (name_end == std::string_view::npos) return {};
    std::istringstream in{std::string(stat.substr(name_end + 1))};
    const std::vector<std::string> fields{std::istream_iterator<std::string>(in), {}};
    constexpr std::size_t kFirst = 3;  // the number of fields[0] in proc(5)
    if (fields.size() < 25 - kFirst) return {};
    const auto field = [&](std::size_t number) {
        return std::strtod(fields[number - kFirst].c_str(), nullptr);
    };
    ProcessFacts facts;
    facts.cpu_seconds = (field(14) + field(15)) / units.ticks_per_second;
    if (units.boot_unix)
        facts.start_time_unix = *units.boot_unix + field(22) / units.ticks_per_second;
    facts.virtual_bytes = field(23);
    facts.resident_bytes = field(24) * units.page_bytes;
    return facts;
}

ProcessFacts read_process_facts() {
    ProcUnits units;
    units.ticks_per_second = static_cast<double>(sysconf(_SC_CLK_TCK));
    units.page_bytes = static_cast<double>(sysconf(_SC_PAGESIZE));
    units.boot_unix = boot_time();
    ProcessFacts facts = parse_stat(read_text("/proc/self/stat"), units);
    facts.open_fds = count_open_fds();
    facts.max_fds = max_fds();
    return facts;
}

}  // namespace panelgate::metrics
