#pragma once

#include <functional>
#include <thread>

namespace panelgate {

/// Starts a thread that gets no signals: those are for the loop's thread.
std::thread start_thread(std::function<void()> run);

}  // namespace panelgate
