#pragma once

#include <memory>
#include <vector>

#include "line_histories.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/web/api/directory.hpp"
#include "plant.hpp"
#include "running_line.hpp"

namespace panelgate::app {

/// What is served: one configuration and the plant made of it, as lines run. A reload makes
/// another; whoever works on this one keeps it to the end of what it does. Does not move.
struct Scene {
    std::shared_ptr<const config::Config> config;
    std::vector<std::shared_ptr<RunningLine>> lines;  ///< by the order of config->lines
    Plant plant;
    /// By the same order; empty where nothing is kept.
    std::vector<std::shared_ptr<bus::LineHistory>> histories;
    web::Directory directory;  ///< REST's view of it all

    Scene() = default;
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
};

/// Of lines that run as the configuration says, in its order.
std::shared_ptr<Scene> make_scene(std::shared_ptr<const config::Config> config,
                                  std::vector<std::shared_ptr<RunningLine>> lines);
/// The past of its points is kept from now on, and of what is the same in `before` (may be null)
/// it goes on; `lines` keeps that of its lines.
void keep_histories(Scene& scene, const Scene* before, LineHistories& lines);

}  // namespace panelgate::app
