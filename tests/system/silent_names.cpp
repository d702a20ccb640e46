// Loaded in front of the system's library: the server of names that end in ".invalid" is silent,
// names that end in ".plant" are this machine's.
#include <dlfcn.h>
#include <netdb.h>
#include <unistd.h>

#include <string_view>

namespace {

using GetAddrInfo = int (*)(const char*, const char*, const addrinfo*, addrinfo**);
constexpr unsigned kSilence = 120;  // seconds: longer than any test waits

}  // namespace

extern "C" int getaddrinfo(const char* host, const char* port, const addrinfo* hints,
                           addrinfo** found) {
    static const auto real = reinterpret_cast<GetAddrInfo>(::dlsym(RTLD_NEXT, "getaddrinfo"));
    const std::string_view name = host == nullptr ? "" : host;
    if (name.ends_with(".invalid")) {
        ::sleep(kSilence);
        return EAI_AGAIN;
    }
    return real(name.ends_with(".plant") ? "127.0.0.1" : host, port, hints, found);
}
