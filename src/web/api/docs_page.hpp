#pragma once

#include <boost/json/object.hpp>
#include <string>
#include <string_view>

namespace panelgate::web {

/// openapi.json, made of the parts that were compiled into the program.
const std::string& openapi_text();
/// An OpenAPI document as a page for people: no script, and nothing from elsewhere. Pure.
std::string docs_page(const boost::json::object& document);
/// What a browser may do with that page: show it, with its own style.
extern const std::string_view kDocsPolicy;

}  // namespace panelgate::web
