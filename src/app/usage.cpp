#include "usage.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace panelgate::app {
namespace {

/// "text,json" as "text or json".
std::string choices(std::string_view list) {
    std::string words;
    while (!list.empty()) {
        const std::size_t comma = std::min(list.find(','), list.size());
        if (!words.empty()) words += comma == list.size() ? " or " : ", ";
        words += list.substr(0, comma);
        list.remove_prefix(std::min(comma + 1, list.size()));
    }
    return words;
}

/// "--format: xml not in {text,json}"
std::string wrong_choice(const std::string& told, const std::string& option) {
    constexpr std::string_view kBetween = " not in {";
    const std::size_t between = told.find(kBetween);
    const std::size_t value = option.size() + 2;
    if (between == told.npos || !told.ends_with('}') || value > between) return told;
    const std::size_t list = between + kBetween.size();
    return option + " must be " +
           choices(std::string_view(told).substr(list, told.size() - list - 1)) + ", not '" +
           told.substr(value, between - value) + '\'';
}

}  // namespace

std::string usage_fault(const CLI::ParseError& error) {
    const std::string told = error.what();
    const std::string kind = error.get_name();
    const std::string option = told.substr(0, told.find(':'));  // or the whole text
    if (kind == "RequiredError") return told.substr(0, told.find(" is required")) + " is missing";
    if (kind == "ArgumentMismatch")
        return option + (told.find("At Most") != told.npos ? " may be given once"
                                                           : " needs a value behind it");
    if (kind == "ConversionError") return "an option that takes no value was given one";
    if (kind == "RequiresError") return told;  // "--weaker requires --rollback"
    if (kind == "ValidationError") return wrong_choice(told, option);
    const int extras =
        static_cast<int>(CLI::ExitCodes::ExtrasError);  // its kind is the command's name
    if (error.get_exit_code() == extras) return "nothing is to stand behind '--'";
    return "these options cannot be understood";
}

}  // namespace panelgate::app
