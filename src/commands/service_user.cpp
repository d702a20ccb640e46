#include "service_user.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "commands.hpp"

namespace panelgate::commands {

namespace {

/// A file or folder that the service uses.
struct Used {
    std::string path;
    int how;           ///< as access(2): R_OK ...
    std::string mode;  ///< that its group needs
};

/// True for what systemd reads as root and hands to the service (LoadCredential in its unit).
bool is_handed_over(const std::string& path) {
    const char* here = std::getenv("CREDENTIALS_DIRECTORY");
    return path.starts_with("/etc/credstore/") || (here != nullptr && path.starts_with(here));
}

std::vector<Used> used_by(const config::Config& config) {
    std::vector<Used> all;
    const auto add = [&](const std::string& path) {
        if (!path.empty() && !is_handed_over(path)) all.push_back({path, R_OK, "640"});
    };
    const auto add_tls = [&](const std::optional<tls::Settings>& tls) {
        if (!tls) return;
        for (const std::string& path : {tls->certificate, tls->key, tls->ca, tls->crl}) add(path);
    };
    for (const config::Line& line : config.lines) {
        add_tls(line.device.tls);
        for (const config::Station& station : line.stations) add(station.points_file);
    }
    for (const tcp_server::Settings& listener : config.modbus_tcp) add_tls(listener.tls);
    if (config.http) {
        add_tls(config.http->tls);
        for (const web::Token& token : config.http->tokens) add(token.file);
    }
    if (config.mqtt) {
        if (config.mqtt->tls) add_tls(config.mqtt->client());
        add(config.mqtt->password_file);
    }
    if (!config.profiles_dir.empty()) all.push_back({config.profiles_dir, R_OK | X_OK, "750"});
    for (const std::string& file : {config.audit ? config.audit->file : "", config.store.file}) {
        const auto folder = std::filesystem::path(file).parent_path();
        std::error_code unknown;
        if (std::filesystem::is_directory(folder, unknown))
            all.push_back({folder.string(), R_OK | W_OK | X_OK, "770"});
    }
    return all;
}

/// Asks in a process of that user, because folders and groups count as well.
bool may(const passwd& user, const Used& used) {
    const pid_t child = ::fork();
    if (child == 0) {
        const bool is_user = ::initgroups(user.pw_name, user.pw_gid) == 0 &&
                             ::setgid(user.pw_gid) == 0 && ::setuid(user.pw_uid) == 0;
        ::_exit(is_user && ::access(used.path.c_str(), used.how) != 0 ? 1 : 0);
    }
    int status = 0;
    return child < 0 || ::waitpid(child, &status, 0) != child || status == 0;
}

}  // namespace

std::optional<gid_t> service_group() {
    const group* found = ::getgrnam(kServiceUser);
    return found == nullptr ? std::nullopt : std::optional(found->gr_gid);
}

std::vector<std::string> service_doubts(const std::string& file, const config::Config& config) {
    std::vector<std::string> doubts;
    const passwd* user = ::geteuid() == 0 ? ::getpwnam(kServiceUser) : nullptr;
    if (user == nullptr) return doubts;
    std::vector<Used> all = used_by(config);
    if (file == kDefaultConfig)
        all.push_back({file, R_OK, "640"});  // else a copy, such as Ansible's
    const std::string name = kServiceUser;
    for (const Used& used : all) {
        if (may(*user, used)) continue;
        doubts.push_back("the service's user " + name + " cannot " +
                         ((used.how & W_OK) != 0 ? "write in " : "read ") + used.path + ": chgrp " +
                         name + ' ' + used.path + "; chmod " + used.mode + ' ' + used.path +
                         "; and it has to be let into the folders above");
    }
    return doubts;
}

}  // namespace panelgate::commands
