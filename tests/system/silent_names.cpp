// Loaded in front of the system's library: the server of names that end in ".invalid" is silent,
// names that end in ".plant" are this machine's. The share of a file NAME is silent while there is
// a file NAME.silent.
#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <unistd.h>

#include <cstdarg>
#include <string>
#include <string_view>

namespace {

using GetAddrInfo = int (*)(const char*, const char*, const addrinfo*, addrinfo**);
using Open = int (*)(const char*, int, mode_t);
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

extern "C" int open(const char* path, int flags, ...) {
    static const auto real = reinterpret_cast<Open>(::dlsym(RTLD_NEXT, "open"));
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    if (::access((std::string(path) + ".silent").c_str(), F_OK) == 0) ::sleep(kSilence);
    return real(path, flags, mode);
}
