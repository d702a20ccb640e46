#include "output.hpp"

#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "commands.hpp"

namespace panelgate::commands {

void print_done(const std::string& text) {
    std::signal(SIGPIPE, SIG_IGN);  // a reader that is gone is told of on stderr as well
    if (std::cout << text << std::flush) return;
    std::cerr << "panelgate: stdout takes nothing; this is done: " << text;
    if (std::freopen("/dev/null", "w", stdout) != nullptr) std::cout.clear();
}

void end_without_output() {
    const int why = errno;
    if (why == EPIPE) std::_Exit(kFine);
    std::cerr << "panelgate: stdout takes nothing: " << std::strerror(why) << '\n';
    std::_Exit(kInternal);
}

ExitCode cannot_write(const OutputFile& output) {
    std::cerr << "panelgate: cannot write " << output.file << ": " << std::strerror(errno) << '\n';
    return kInternal;
}

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

/// "x": a file that was created meanwhile is not overwritten either.
bool write(const OutputFile& output, const std::string& text) {
    std::FILE* file = std::fopen(output.file.c_str(), output.force ? "w" : "wx");
    const bool written = file != nullptr && std::fputs(text.c_str(), file) >= 0;
    const bool closed = file != nullptr && std::fclose(file) == 0;
    const int why = errno;
    const bool is_part = file != nullptr && !(written && closed);
    if (is_part && !output.force) ::unlink(output.file.c_str());
    errno = why;
    return written && closed;
}

}  // namespace panelgate::commands
