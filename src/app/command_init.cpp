#include <unistd.h>
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

ExitCode cannot_write(const OutputFile& output) {
    std::cerr << "panelgate: cannot write " << output.file << ": " << std::strerror(errno) << '\n';
    return kInternal;
}

/// Before a minute is spent on the scan: whether there will be a file, without making one.
ExitCode may_write(const OutputFile& output) {
    if (output.file.empty()) return kFine;
    const std::filesystem::path file(output.file);
    std::error_code none;
    const bool is_there = std::filesystem::exists(file, none);
    if (is_there && !output.force) {
        std::cerr << "panelgate: " << output.file
                  << " is there already; give another name, or --force to write over it\n";
        return kUsage;
    }
    if (std::filesystem::is_directory(file, none) || !file.has_filename()) {
        errno = EISDIR;
        return cannot_write(output);
    }
    const std::string folder = file.has_parent_path() ? file.parent_path().string() : ".";
    const bool may = is_there ? ::access(file.c_str(), W_OK) == 0
                              : ::access((folder + "/.").c_str(), W_OK | X_OK) == 0;
    return may ? kFine : cannot_write(output);
}

/// "x": what has come into being meanwhile is not written over either.
bool write(const OutputFile& output, const std::string& text) {
    std::FILE* file = std::fopen(output.file.c_str(), output.force ? "w" : "wx");
    const bool written = file != nullptr && std::fputs(text.c_str(), file) >= 0;
    const bool closed = file != nullptr && std::fclose(file) == 0;
    return written && closed;
}

}  // namespace

ExitCode init(const ScanOptions& options, const OutputFile& output) {
    if (const ExitCode refused = may_write(output); refused != kFine) return refused;
    const Searched searched = search(options);
    if (!searched.result) return searched.code;
    tell_advice(options, *searched.result);
    const bool cut_short = !searched.cut_short.empty();
    if (!scan::found_any(*searched.result)) {
        if (cut_short) std::cerr << "panelgate: " << searched.cut_short << '\n';
        std::cerr << "panelgate: there is nothing to write\n";
        return kUnavailable;
    }
    const std::string text = starter_yaml(
        {searched.device, searched.profiles_dir, *searched.result, *searched.profiles});
    if (output.file.empty())
        std::cout << text << std::flush;
    else if (!write(output, text))
        return cannot_write(output);
    else
        std::cerr << "panelgate: wrote " << output.file << " with "
                  << searched.result->stations.size() << " station(s); run -c " << output.file
                  << " runs it\n";
    if (cut_short)
        std::cerr << "panelgate: incomplete: " << searched.cut_short << "; what was not reached "
                  << "is missing in it\n";
    return searched.code;
}

ExitCode scan(const ScanOptions& options) {
    const Searched searched = search(options);
    if (!searched.result) return searched.code;
    if (options.yaml)
        std::cout << scan::report_yaml(searched.device, *searched.result, searched.profiles_dir);
    else
        std::cout << scan::report_text(options.device, *searched.result, searched.cut_short);
    std::cout << std::flush;
    tell_advice(options, *searched.result);
    return searched.code;
}

}  // namespace panelgate::app
