#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "commands.hpp"
#include "panelgate/scan/report.hpp"
#include "searched.hpp"
#include "starter.hpp"

namespace panelgate::app {
namespace {

/// Before a minute is spent on the scan.
bool may_write(const OutputFile& output) {
    std::error_code none;
    if (output.file.empty() || output.force || !std::filesystem::exists(output.file, none))
        return true;
    std::cerr << "panelgate: " << output.file
              << " is there already; give another name, or --force to write over it\n";
    return false;
}

/// "x": what has come into being meanwhile is not written over either.
bool write(const OutputFile& output, const std::string& text) {
    std::FILE* file = std::fopen(output.file.c_str(), output.force ? "w" : "wx");
    const bool written = file != nullptr && std::fputs(text.c_str(), file) >= 0;
    const bool closed = file != nullptr && std::fclose(file) == 0;
    if (written && closed) return true;
    std::cerr << "panelgate: cannot write " << output.file << ": " << std::strerror(errno) << '\n';
    return false;
}

}  // namespace

ExitCode init(const ScanOptions& options, const OutputFile& output) {
    if (!may_write(output)) return kUsage;
    const Searched searched = search(options);
    if (!searched.result) return searched.code;
    tell_advice(options, *searched.result);
    if (!scan::found_any(*searched.result)) {
        if (!searched.cut_short.empty()) std::cerr << "panelgate: " << searched.cut_short << '\n';
        std::cerr << "panelgate: there is nothing to write\n";
        return kUnavailable;
    }
    const std::string text = starter_yaml(
        {searched.device, searched.profiles_dir, *searched.result, *searched.profiles});
    if (output.file.empty())
        std::cout << text << std::flush;
    else if (!write(output, text))
        return kInternal;
    else
        std::cerr << "panelgate: wrote " << output.file << " with "
                  << searched.result->stations.size() << " station(s); run -c " << output.file
                  << " runs it\n";
    return searched.code;
}

}  // namespace panelgate::app
