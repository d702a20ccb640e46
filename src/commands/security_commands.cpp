#include <CLI/CLI.hpp>
#include <memory>

#include "command_line.hpp"

namespace panelgate::commands {

namespace {

void add_files(CLI::App* sub, AuditOptions& typed) {
    sub->add_option("FILE", typed.files,
                    "files of one audit, in any order; without: those of the configuration");
    sub->add_option("-c,--config", typed.config, "configuration file")->capture_default_str();
}

void add_audit(CLI::App& cli, ExitCode& code) {
    CLI::App* command =
        cli.add_subcommand("audit", "prove that an audit is whole, or look something up in it");
    command->group(kSecurity);
    command->require_subcommand(1);
    const auto typed = std::make_shared<AuditOptions>();
    CLI::App* verify =
        command->add_subcommand("verify",
                                "name the first record that was changed, removed, added "
                                "or put elsewhere");
    add_files(verify, *typed);
    verify
        ->add_option(
            "--log", typed->logs,
            "the gateway's log, whose `audit anchor` lines name records: finds a chain "
            "that was made anew, and what was cut off at the end; - for standard input; once for "
            "each log")
        ->allow_extra_args(false);
    verify->footer(
        "Exit codes: 0 the chain is whole; 1 it is not; 64 usage; 66 a file cannot be "
        "read.");
    verify->callback([typed, &code] { code = audit_verify(*typed); });
    CLI::App* show = command->add_subcommand("show", "print records");
    add_files(show, *typed);
    show->add_option("--station", typed->station, "only records of this station");
    show->add_option("--since", typed->since,
                     "only since then: 30min, 1h, 7d, or a time such as 2026-11-26T08:00:00Z");
    show->add_option("--until", typed->until, "only until then, written like --since");
    show->add_option("--kind", typed->kind,
                     "only of this kind: write, refusal, repeats, login, reload, token, ...");
    show->add_option("--client", typed->client,
                     "only of clients, tokens and users with this in their name");
    show->add_flag("--json", typed->json, "print the lines as they are");
    show->footer(
        "Exit codes: 0 fine; 1 there is no such record; 64 usage; 66 a file cannot be "
        "read.\nIt does not verify: `panelgate audit verify` does.");
    show->callback([typed, &code] { code = audit_show(*typed); });
}

void add_token(CLI::App& cli, ExitCode& code) {
    CLI::App* command = cli.add_subcommand("token", "make tokens for clients of REST");
    command->group(kSecurity);
    command->require_subcommand(1);
    const auto typed = std::make_shared<TokenOptions>();
    CLI::App* fresh = command->add_subcommand(
        "new", "make a token: print it once, and what goes into the configuration");
    fresh->add_option("--name", typed->name, "its name in logs and in the audit, such as scada")
        ->required();
    fresh
        ->add_option("--role", typed->role,
                     "what it may do: viewer, operator, engineer, admin, or a role of your own")
        ->capture_default_str();
    fresh->add_option("--expires", typed->expires,
                      "how long it is known, such as 90d or 2y, or its last day, 2027-12-31");
    fresh->add_option("-o,--output", typed->output,
                      "write its hash to this new file, which the configuration then names");
    fresh->footer(
        "The file holds the hash alone: who reads it cannot use the token.\nExit codes: 0 "
        "it is made; 64 usage, or the file is there; 70 it cannot be written.");
    fresh->callback([typed, &code] { code = token_new(*typed); });
}

}  // namespace

void add_security_commands(CLI::App& cli, ExitCode& code) {
    add_audit(cli, code);
    add_token(cli, code);
}

}  // namespace panelgate::commands
