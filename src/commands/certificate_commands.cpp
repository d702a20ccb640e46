#include "command_line.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/tls/judge.hpp"
#include "panelgate/tls/peer.hpp"
#include "panelgate/tls/replacement.hpp"

namespace panelgate::commands {
namespace {

/// The command line of `cert` as typed.
struct CertificateOptions {
    std::vector<std::string> names;  ///< of the certificate; of `revoke`, its file
    std::string role;
    std::string role_word;  ///< a role that only rules know
    std::string dir = ".";  ///< of the files, the CA's included
    int days = 0;
    bool force = false;  ///< replace files
};

constexpr mode_t kPublic = 0644;
constexpr mode_t kSecret = 0600;

tls::Validity validity_of(const CertificateOptions& options) {
    return {gateway::seconds_since_1970(), options.days};
}

std::string in_folder(const CertificateOptions& options, const std::string& name) {
    return options.dir.empty() || options.dir == "." ? name : options.dir + '/' + name;
}

ExitCode cannot(const std::string& what, const std::string& path, ExitCode code) {
    std::cerr << "panelgate: cannot " << what << ' ' << path << ": " << std::strerror(errno)
              << '\n';
    return code;
}

/// Files that are all replaced, each in one step, or none: a gateway that reads them meanwhile has
/// the old or the new.
class Files {
  public:
    Files() = default;
    ~Files() {
        for (const std::string& path : paths_) ::unlink(fresh(path).c_str());
    }
    Files(const Files&) = delete;
    Files& operator=(const Files&) = delete;

    /// Writes it under another name; false, and errno, if that fails.
    bool write(const std::string& path, const std::string& text, mode_t mode) {
        struct stat there{};
        if (::stat(path.c_str(), &there) == 0 && S_ISDIR(there.st_mode)) {
            errno = EISDIR;
            return false;
        }
        const int file =
            ::open(fresh(path).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
        if (file < 0) return false;
        paths_.push_back(path);
        errno = ENOSPC;  // of a short write
        const bool written =
            ::fchmod(file, mode) == 0 &&
            ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
            ::fsync(file) == 0;
        const int why = errno;
        const bool closed = ::close(file) == 0;
        if (!written) errno = why;
        return written && closed;
    }
    /// Prints what is written, then writes: no file is written where stdout takes nothing.
    ExitCode keep(const std::string& said) {
        std::signal(SIGPIPE, SIG_IGN);
        if (!(std::cout << said << std::flush)) {
            std::cerr << "panelgate: stdout takes nothing; nothing is written\n";
            std::cout.clear();
            return kInternal;
        }
        while (!paths_.empty()) {
            const std::string path = paths_.front();
            if (std::rename(fresh(path).c_str(), path.c_str()) != 0)
                return cannot("write", path, kUnavailable);
            paths_.erase(paths_.begin());
        }
        return kFine;
    }

  private:
    static std::string fresh(const std::string& path) { return path + ".new"; }

    std::vector<std::string> paths_;
};

/// One at a time works in a folder: two that add to one list would lose one's addition.
class Turn {
  public:
    explicit Turn(const std::string& folder)
        : folder_(
              ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
        if (folder_ >= 0) ::flock(folder_, LOCK_EX);
    }
    ~Turn() {
        if (folder_ >= 0) ::close(folder_);
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

  private:
    int folder_;
};

/// Writes NAME.key and NAME.crt; says so, and what to do with them.
ExitCode write_pair(const CertificateOptions& options, const std::string& name,
                    const tls::Issued& issued, const std::string& advice) {
    const std::string key = in_folder(options, name + ".key");
    const std::string certificate = in_folder(options, name + ".crt");
    for (const std::string& path : {key, certificate}) {
        if (options.force || ::access(path.c_str(), F_OK) != 0) continue;
        std::cerr << "panelgate: " << path << " is there already; --force replaces it\n";
        return kUnavailable;
    }
    Files files;
    if (!files.write(key, issued.key, kSecret)) return cannot("write", key, kUnavailable);
    if (!files.write(certificate, issued.certificate, kPublic))
        return cannot("write", certificate, kUnavailable);
    // A CA's end is that of what it has signed.
    return files.keep("wrote " + certificate + " and " + key + ", valid until " +
                      tls::date_text(tls::summary_of(issued.certificate).end) + '\n' + advice);
}

std::optional<tls::Issued> read_ca(const CertificateOptions& options, ExitCode& code) {
    tls::Issued ca;
    for (const auto& [name, into] :
         {std::pair("ca.crt", &ca.certificate), std::pair("ca.key", &ca.key)}) {
        const auto text = config::RealFiles::read_any(in_folder(options, name));
        if (!text) {
            std::cerr << "panelgate: cannot read the CA's " << in_folder(options, name)
                      << "; `panelgate cert new-ca` makes it, --dir says where it is\n";
            code = kNoInput;
            return std::nullopt;
        }
        *into = *text;
    }
    return ca;
}

/// A file's name of a certificate's: letters, digits, '.', '-' and '_', as long as one may be.
std::string file_name(std::string name) {
    constexpr std::size_t kLongest = 200;
    std::ranges::replace_if(
        name,
        [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-' && c != '_'; },
        '_');
    if (name.starts_with('-')) name.front() = '_';  // commands would take it for an option
    return name.substr(0, kLongest);
}

/// Runs the deed, and prints the fault of a failed deed.
template <class Make>
ExitCode explained(const Make& make) try {
    return make();
} catch (const tls::WrongName& why) {
    std::cerr << "panelgate: cert: " << why.what() << '\n';
    return kUsage;
} catch (const tls::CannotIssue& why) {
    std::cerr << "panelgate: " << why.what() << '\n';
    return kUnavailable;
}

template <class Make>
ExitCode with_ca(const CertificateOptions& options, const Make& make) {
    return explained([&] {
        const Turn turn(options.dir);
        ExitCode code = kFine;
        const auto ca = read_ca(options, code);
        return ca ? make(*ca) : code;
    });
}

ExitCode new_certificate_authority(const CertificateOptions& options) {
    return explained([&] {
        const Turn turn(options.dir);
        const std::string name = options.names.empty() ? "Plant CA" : options.names.front();
        return write_pair(
            options, "ca", tls::issue_ca(name, validity_of(options)),
            "Keep ca.key on a machine that is kept safe, and a copy of it: it signs all "
            "others. No gateway needs it.\n"
            "ca.crt goes to every gateway (`tls: ca`) and to every client, as the CA that "
            "it trusts.\n");
    });
}

ExitCode new_server_certificate(const CertificateOptions& options) {
    return with_ca(options, [&](const tls::Issued& ca) {
        const std::string name = file_name(options.names.front());
        return write_pair(
            options, name, tls::issue_server(ca, options.names, validity_of(options)),
            "Both go to the gateway, readable by its user alone (chown panelgate, chmod "
            "600 the key):\n  tls: {certificate: /etc/panelgate/tls/" +
                name + ".crt, key: /etc/panelgate/tls/" + name +
                ".key, ca: /etc/panelgate/tls/ca.crt, client: required}\n");
    });
}

/// Words that only the rules of a plant know are asked for as such: a misspelt role would read
/// only.
std::optional<std::string> role_of(const CertificateOptions& options) {
    if (!options.role_word.empty()) return options.role_word;
    if (options.role.empty()) return std::nullopt;
    if (tls::role_named(options.role) != Role::none) return options.role;
    throw tls::WrongName("--role is viewer, operator, engineer or admin, not '" + options.role +
                         "'; a word of your own that the rules of `access` know: --role-word");
}

ExitCode new_client_certificate(const CertificateOptions& options) {
    return with_ca(options, [&](const tls::Issued& ca) {
        const std::optional<std::string> role = role_of(options);
        return write_pair(
            options, file_name(options.names.front()),
            tls::issue_client(ca, options.names.front(), role, validity_of(options)),
            "Both go to the client, with ca.crt as the CA that it trusts. " +
                (role ? "Its role is " + *role : std::string("It has no role, so it only reads")) +
                " where a gateway has `role_from: certificate`.\n");
    });
}

ExitCode revoke_certificate(const CertificateOptions& options) {
    return with_ca(options, [&](const tls::Issued& ca) {
        std::optional<std::string> given;
        if (!options.names.empty()) {
            given = config::RealFiles::read_any(options.names.front());
            if (!given) return cannot("read", options.names.front(), kNoInput);
        }
        const std::string path = in_folder(options, "crl.pem");
        const auto former = config::RealFiles::read_any(path);
        if (!former && errno != ENOENT) return cannot("read", path, kNoInput);
        if (former && former->empty())
            throw tls::CannotIssue(path +
                                   " is empty, though it should name who is revoked already: bring "
                                   "back a copy, such as a gateway's; or remove it, and revoke all "
                                   "of them again");
        const std::string list = tls::revoke(
            ca, former.value_or(""), given ? std::optional<std::string_view>(*given) : std::nullopt,
            validity_of(options));
        Files files;
        if (!files.write(path, list, kPublic)) return cannot("write", path, kUnavailable);
        return files.keep("wrote " + path +
                          "\nIt goes to every gateway (`tls: crl`), which takes it without a "
                          "restart" +
                          (given ? ", and closes the connections of this certificate" : "") +
                          ".\n");
    });
}

constexpr const char* kFooter =
    "new-ca once, on a machine that is kept safe; new-server one a gateway, with all its names and "
    "addresses; new-client one a client.\n"
    "Files are written to --dir: NAME.crt (public) and NAME.key (secret, readable by you alone).\n"
    "Exit codes: 0 fine; 64 usage; 66 a file cannot be read; 69 it cannot be written, or used.";

struct Adder {
    CLI::App& cert;
    ExitCode& code;

    CLI::App* add(const char* name, const char* about, int days,
                  const std::shared_ptr<CertificateOptions>& typed) const {
        CLI::App* command = cert.add_subcommand(name, about);
        typed->days = days;
        command->add_option("--dir", typed->dir, "folder of the files, those of the CA included")
            ->capture_default_str();
        command->add_option("--days", typed->days, "how long it is valid")
            ->check(CLI::Range(1, 36500))
            ->capture_default_str();
        command->add_flag("--force", typed->force, "replace files that are there");
        return command;
    }
    void on_call(CLI::App* command, ExitCode (*run)(const CertificateOptions&),
                 const std::shared_ptr<CertificateOptions>& typed) const {
        command->callback([&into = code, run, typed] { into = run(*typed); });
    }
};

}  // namespace

void add_certificate_commands(CLI::App& cli, ExitCode& code) {
    CLI::App* cert =
        cli.add_subcommand("cert", "make certificates: a CA, the gateway's, those of clients");
    cert->require_subcommand(1);
    cert->footer(kFooter);
    const Adder adder{*cert, code};

    auto ca = std::make_shared<CertificateOptions>();
    ca->names = {"Plant CA"};
    CLI::App* new_ca = adder.add("new-ca", "the plant's CA: ca.crt and ca.key", 3650, ca);
    new_ca->add_option("NAME", ca->names, "its name")->expected(0, 1);
    adder.on_call(new_ca, new_certificate_authority, ca);

    auto server = std::make_shared<CertificateOptions>();
    CLI::App* new_server = adder.add("new-server", "a gateway's certificate", 825, server);
    new_server->add_option("NAME", server->names, "its host names and IP addresses")->required();
    adder.on_call(new_server, new_server_certificate, server);

    auto client = std::make_shared<CertificateOptions>();
    CLI::App* new_client = adder.add("new-client", "a client's certificate", 825, client);
    new_client->add_option("NAME", client->names, "its name")->required()->expected(1);
    CLI::Option* const role = new_client->add_option(
        "--role", client->role, "viewer, operator, engineer or admin; without: it only reads");
    new_client
        ->add_option("--role-word", client->role_word,
                     "instead: a word of your own, which the rules of `access` know")
        ->excludes(role);
    adder.on_call(new_client, new_client_certificate, client);

    auto lost = std::make_shared<CertificateOptions>();
    CLI::App* revoke =
        adder.add("revoke", "add a certificate to the list of revoked ones, crl.pem", 365, lost);
    revoke->add_option("FILE", lost->names, "the certificate; without it the list is made anew")
        ->expected(0, 1);
    adder.on_call(revoke, revoke_certificate, lost);
}

}  // namespace panelgate::commands
