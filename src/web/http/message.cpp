#include "panelgate/web/http/message.hpp"

#include <utility>
#include <vector>

#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

void Caller::identify(std::string token, Standing standing, std::string listener) {
    if (who_ && who_->token == token && who_->listener == listener && who_->standing == standing)
        return;
    Who who = who_ ? *who_ : Who{.face = Face::http, .address = address_};
    who.name = "http";
    if (!address_.empty()) who.name += ' ' + address_;
    if (!token.empty()) who.name += " token " + token;
    who.token = std::move(token);
    who.standing = std::move(standing);
    who.listener = std::move(listener);
    who_ = make_who(std::move(who));
}

void Caller::certify(std::string subject, std::string word, std::optional<Standing> standing) {
    Who who = *who_;
    who.certificate = std::move(subject);
    who.certificate_role = std::move(word);
    certificate_role_ = std::move(standing);
    who_ = make_who(std::move(who));
}

std::string_view header(const HttpRequest& request, const std::string& name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string_view() : found->second;
}

void add_vary(HttpResponse& response, const std::string& name) {
    for (auto& [header, value] : response.headers) {
        if (header != "Vary") continue;
        if (value.find(name) == std::string::npos) value += ", " + name;
        return;
    }
    response.headers.emplace_back("Vary", name);
}

void log_client(const Caller& caller, std::string_view event,
                std::initializer_list<std::pair<std::string_view, std::string>> fields) {
    std::vector<rt::LogField> all{{"client", caller.name()}};
    const std::string& certificate = caller.who()->certificate;
    if (!certificate.empty()) all.emplace_back("certificate", certificate);
    for (const auto& [key, value] : fields) all.emplace_back(key, excerpt(value));
    rt::log(rt::LogLevel::info, event, all);
}

}  // namespace panelgate::web
