#include "request_reader.hpp"

#include <cstdlib>

#include "mbap_reader.hpp"
#include "serial_readers.hpp"

namespace panelgate::tcp_server {

std::unique_ptr<RequestReader> make_request_reader(const Settings& settings) {
    switch (settings.framing) {
        case modbus::Framing::tcp:
            return std::make_unique<MbapReader>(settings);
        case modbus::Framing::rtu:
            return std::make_unique<RtuReader>(settings);
        case modbus::Framing::ascii:
            return std::make_unique<AsciiReader>(settings);
    }
    std::abort();
}

}  // namespace panelgate::tcp_server
