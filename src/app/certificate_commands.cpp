#include "certificate_commands.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

namespace panelgate::app {
namespace {

constexpr const char* kFooter =
    "Files are written to --dir: NAME.crt (public) and NAME.key (secret, readable by you alone).\n"
    "\n"
    "  panelgate cert new-ca                              once, on a machine that is kept safe\n"
    "  panelgate cert new-server gateway.plant 10.0.0.5   one a gateway, all its names and "
    "addresses\n"
    "  panelgate cert new-client scada --role operator    one a client\n"
    "  panelgate cert revoke scada.crt                    no longer valid: writes crl.pem\n"
    "\n"
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
    new_client->add_option("--role", client->role,
                           "viewer, operator, engineer or admin, or another word that the rules of "
                           "`access` know; without: it only reads");
    adder.on_call(new_client, new_client_certificate, client);

    auto lost = std::make_shared<CertificateOptions>();
    CLI::App* revoke =
        adder.add("revoke", "add a certificate to the list of revoked ones, crl.pem", 365, lost);
    revoke->add_option("FILE", lost->names, "the certificate")->required()->expected(1);
    adder.on_call(revoke, revoke_certificate, lost);
}

}  // namespace panelgate::app
