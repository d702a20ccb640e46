#include "panelgate/base/transaction_end.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(TransactionEnd end) {
    switch (end) {
        case TransactionEnd::open:
            return "open";
        case TransactionEnd::ok:
            return "ok";
        case TransactionEnd::exception:
            return "exception";
        case TransactionEnd::timeout:
            return "timeout";
        case TransactionEnd::damaged:
            return "damaged";
        case TransactionEnd::wrong:
            return "wrong";
        case TransactionEnd::doubtful:
            return "doubtful";
        case TransactionEnd::line_down:
            return "line_down";
    }
    std::abort();
}

bool is_error(TransactionEnd end) {
    switch (end) {
        case TransactionEnd::open:
        case TransactionEnd::ok:
        case TransactionEnd::exception:
        case TransactionEnd::doubtful:
            return false;
        case TransactionEnd::timeout:
        case TransactionEnd::damaged:
        case TransactionEnd::wrong:
        case TransactionEnd::line_down:
            return true;
    }
    std::abort();
}

}  // namespace panelgate
