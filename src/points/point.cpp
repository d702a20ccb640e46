#include "panelgate/points/point.hpp"

#include <cstdlib>

namespace panelgate::points {

std::string_view label(Type type) {
    switch (type) {
        case Type::boolean:
            return "bool";
        case Type::u16:
            return "u16";
        case Type::i16:
            return "i16";
        case Type::u32:
            return "u32";
        case Type::i32:
            return "i32";
        case Type::u64:
            return "u64";
        case Type::i64:
            return "i64";
        case Type::f32:
            return "f32";
        case Type::f64:
            return "f64";
        case Type::bcd16:
            return "bcd16";
        case Type::bcd32:
            return "bcd32";
        case Type::string:
            return "string";
    }
    std::abort();
}

unsigned registers_of(Type type) {
    switch (type) {
        case Type::boolean:
        case Type::u16:
        case Type::i16:
        case Type::bcd16:
        case Type::string:
            return 1;
        case Type::u32:
        case Type::i32:
        case Type::f32:
        case Type::bcd32:
            return 2;
        case Type::u64:
        case Type::i64:
        case Type::f64:
            return 4;
    }
    std::abort();
}

std::string_view label(WordOrder order) {
    switch (order) {
        case WordOrder::abcd:
            return "ABCD";
        case WordOrder::badc:
            return "BADC";
        case WordOrder::cdab:
            return "CDAB";
        case WordOrder::dcba:
            return "DCBA";
    }
    std::abort();
}

unsigned Point::count() const {
    if (modbus::is_bit_table(table)) return 1;
    return type == Type::string ? (length + 1) / 2 : registers_of(type);
}

}  // namespace panelgate::points
