#include "command_line.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/config/real_files.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/tls/judge.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::commands {
namespace {

/// The command line of `cert` as typed.
struct CertificateOptions {
    std::vector<std::string> names;  ///< of the certificate; of `revoke`, its file
    std::string role;
    std::string role_word;  ///< a role that only rules know
    std::string dir;        ///< of the files, the CA's included
    int days = 0;
    bool force = false;  ///< replace files

    std::string path(const std::string& name) const { return dir == "." ? name : dir + '/' + name; }
    tls::Validity validity() const { return {gateway::seconds_since_1970(), days}; }
    std::string read(const std::string& file) const {
        const auto text = config::RealFiles::read_any(file);
        if (!text) throw tls::CannotIssue("cannot read " + file + ": " + std::strerror(errno));
        return *text;
    }
    tls::Issued ca() const try {
        const std::string key = path("ca.key");
        if (config::RealFiles().is_readable_by_all(key))
            std::cerr << "panelgate: cert: every user of this machine can read " << key
                      << ", and so sign certificates; `chmod 600 " << key << "`\n";
        return {read(path("ca.crt")), read(key)};
    } catch (const tls::CannotIssue& why) {
        throw tls::CannotIssue(std::string(why.what()) +
                               "; `panelgate cert new-ca` makes a CA, --dir says where it is");
    }
};

struct File {
    std::string path;
    std::string text;
    mode_t mode;

    std::string fresh() const { return path + ".new"; }
    bool write() const {
        const int file = ::open(fresh().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
        const bool done =
            file >= 0 && ::fchmod(file, mode) == 0 &&
            ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
            ::fsync(file) == 0;
        if (file >= 0) ::close(file);
        return done;
    }
    bool put_in_place() const { return std::rename(fresh().c_str(), path.c_str()) == 0; }
};

/// Writes all files under other names, then puts each in its place in one step: a gateway that
/// reads meanwhile has the old file or the new one, and a full disk changes nothing.
void write(const std::vector<File>& files) {
    errno = ENOSPC;  // of a short write
    for (const auto step : {&File::write, &File::put_in_place}) {
        const auto failed =
            std::ranges::find_if_not(files, [&](const File& one) { return (one.*step)(); });
        if (failed == files.end()) continue;
        const std::string why = std::strerror(errno);
        for (const File& one : files) ::unlink(one.fresh().c_str());
        throw tls::CannotIssue("cannot write " + failed->path + ": " + why);
    }
}

/// Returns a file's name for a certificate's: letters, digits, '.', '-' and '_', at most 200.
std::string file_name(std::string name) {
    std::ranges::replace_if(
        name,
        [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-' && c != '_'; },
        '_');
    if (name.starts_with('-')) name.front() = '_';  // commands would take it for an option
    return name.substr(0, 200);
}

/// Writes NAME.key and NAME.crt; says so, and what to do with them.
void write_pair(const CertificateOptions& typed, const std::string& name, const tls::Issued& issued,
                const std::string& advice) {
    const std::string key = typed.path(name + ".key");
    const std::string certificate = typed.path(name + ".crt");
    for (const std::string& path : {key, certificate})
        if (!typed.force && ::access(path.c_str(), F_OK) == 0)
            throw tls::CannotIssue(path + " is there already; --force replaces it");
    write({{key, issued.key, 0600}, {certificate, issued.certificate, 0644}});
    std::cout << "wrote " << certificate << " and " << key << ", valid until "
              << tls::date_text(tls::summary_of(issued.certificate).end) << '\n'
              << advice;
}

void new_authority(const CertificateOptions& typed) {
    write_pair(typed, "ca", tls::issue_ca(typed.names.front(), typed.validity()),
               "Keep ca.key on a machine that is kept safe, and a copy of it: it signs all others. "
               "No gateway needs it.\n"
               "ca.crt goes to every gateway (`tls: ca`) and to every client, as the CA that it "
               "trusts.\n");
}

void new_server(const CertificateOptions& typed) {
    const std::string name = file_name(typed.names.front());
    write_pair(typed, name, tls::issue_server(typed.ca(), typed.names, typed.validity()),
               "Both go to the gateway, readable by its user alone (chown panelgate, chmod 600 the "
               "key):\n  tls: {certificate: /etc/panelgate/tls/" +
                   name + ".crt, key: /etc/panelgate/tls/" + name +
                   ".key, ca: /etc/panelgate/tls/ca.crt, client: required}\n");
}

void new_client(const CertificateOptions& typed) {
    if (!typed.role.empty() && tls::role_named(typed.role) == Role::none)
        throw tls::CannotIssue("--role is viewer, operator, engineer or admin, not '" + typed.role +
                                   "'; a word of your own that the rules of `access` know: "
                                   "--role-word",
                               true);
    const std::string word = typed.role + typed.role_word;
    const auto role = word.empty() ? std::nullopt : std::optional(word);
    write_pair(
        typed, file_name(typed.names.front()),
        tls::issue_client(typed.ca(), typed.names.front(), role, typed.validity()),
        "Both go to the client, with ca.crt as the CA that it trusts. " +
            (role ? "Its role is " + *role : std::string("It has no role, so it only reads")) +
            " where a gateway has `role_from: certificate`.\n");
}

void revoke(const CertificateOptions& typed) {
    const std::string path = typed.path("crl.pem");
    std::optional<std::string> given;
    if (!typed.names.empty()) given = typed.read(typed.names.front());
    const bool is_first = ::access(path.c_str(), F_OK) != 0 && errno == ENOENT;
    const std::string former = is_first ? "" : typed.read(path);
    if (!is_first && former.empty())
        throw tls::CannotIssue(path +
                               " is empty, though it should name who is revoked already: "
                               "bring back a copy, such as a gateway's");
    write({{path, tls::revoke(typed.ca(), former, given, typed.validity()), 0644}});
    std::cout << "wrote " << path << "\nIt goes to every gateway (`tls: crl`), which takes it "
              << "without a restart"
              << (given ? ", and closes the connections of this certificate" : "") << ".\n";
}

constexpr const char* kFooter =
    "new-ca once, on a machine that is kept safe; new-server one a gateway, with all its names and "
    "addresses; new-client one a client.\n"
    "Files are written to --dir: NAME.crt (public) and NAME.key (secret, readable by you alone).\n"
    "Exit codes: 0 fine; 64 usage; 69 a file cannot be read or written, or used.";

/// Adds a command that runs `deed` and prints the fault of a failed deed.
CLI::App* add(CLI::App& cert, ExitCode& code, const char* name, const char* about,
              void (*deed)(const CertificateOptions&),
              const std::shared_ptr<CertificateOptions>& typed) {
    CLI::App* command = cert.add_subcommand(name, about);
    command->add_option("--dir", typed->dir, "folder of the files, those of the CA included")
        ->default_str(".");
    command->add_option("--days", typed->days, "how long it is valid")
        ->check(CLI::Range(1, 36500))
        ->capture_default_str();
    command->add_flag("--force", typed->force, "replace files that are there");
    command->callback([&code, deed, typed] {
        if (typed->dir.empty()) typed->dir = ".";
        try {
            deed(*typed);
        } catch (const tls::CannotIssue& why) {
            std::cerr << "panelgate: cert: " << why.what() << '\n';
            code = why.wrong_name ? kUsage : kUnavailable;
        }
    });
    return command;
}

}  // namespace

void add_certificate_commands(CLI::App& cli, ExitCode& code) {
    CLI::App* cert =
        cli.add_subcommand("cert", "make certificates: a CA, the gateway's, those of clients");
    cert->require_subcommand(1);
    cert->footer(kFooter);
    const auto typed = [](int days) {
        auto made = std::make_shared<CertificateOptions>();
        made->days = days;
        return made;
    };
    const auto ca = typed(3650);
    ca->names = {"Plant CA"};
    add(*cert, code, "new-ca", "the plant's CA: ca.crt and ca.key", new_authority, ca)
        ->add_option("NAME", ca->names, "its name")
        ->expected(0, 1);
    const auto server = typed(825);
    add(*cert, code, "new-server", "a gateway's certificate", new_server, server)
        ->add_option("NAME", server->names, "its host names and IP addresses")
        ->required();
    const auto client = typed(825);
    CLI::App* made = add(*cert, code, "new-client", "a client's certificate", new_client, client);
    made->add_option("NAME", client->names, "its name")->required()->expected(1);
    CLI::Option* const role = made->add_option(
        "--role", client->role, "viewer, operator, engineer or admin; without: it only reads");
    made->add_option("--role-word", client->role_word,
                     "instead: a word of your own, which the rules of `access` know")
        ->excludes(role);
    const auto lost = typed(365);
    add(*cert, code, "revoke", "add a certificate to the list of revoked ones, crl.pem", revoke,
        lost)
        ->add_option("FILE", lost->names, "the certificate; without it the list is made anew")
        ->expected(0, 1);
}

}  // namespace panelgate::commands
