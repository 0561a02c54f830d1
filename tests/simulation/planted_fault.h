#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace treeroll::simulation {

/// The planted fault at work. None in any program but planted_faults_test, whose copy of the cores
/// asks for it by name where each fault is planted.
struct PlantedFault {
  static inline std::string active;
  static inline int memory = 0;  ///< what a fault must remember
};

inline bool planted(std::string_view name) { return PlantedFault::active == name; }

/// While it lives no fault is at work: for what a simulation is compared with.
class WithoutFault {
 public:
  WithoutFault() : active_(std::exchange(PlantedFault::active, {})) {}
  ~WithoutFault() { PlantedFault::active = active_; }
  WithoutFault(const WithoutFault&) = delete;
  WithoutFault& operator=(const WithoutFault&) = delete;

 private:
  std::string active_;
};

}  // namespace treeroll::simulation
