#include "panelgate/modbus/response.hpp"

#include <algorithm>
#include <cstdlib>

#include "panelgate/modbus/function.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

/// The first byte is the size of the request, the reply follows it. What matches has the function
/// and, unless it is an exception, the length that the request predicts.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const ByteView rest(data + 1, size - 1);
    const ByteView request = rest.first(std::min<std::size_t>(data[0], rest.size()));
    const ByteView reply = rest.subspan(request.size());
    registers_of(reply);
    bits_of(reply, 2040);
    if (!answers(request, reply)) return 0;
    if ((reply[0] | kExceptionBit) != (request[0] | kExceptionBit)) std::abort();
    if (!check_request(request, QuantityCheck::wide) || exception_of(reply)) return 0;
    const std::optional<std::size_t> expected = reply_length_from_request(request);
    if (expected && *expected != reply.size() + 3) std::abort();
    return 0;
}
