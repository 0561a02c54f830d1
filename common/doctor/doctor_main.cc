#include "common/doctor/doctor.h"
#include "common/program/program.h"
#include "common/transport/bus.h"

namespace treeroll::doctor {
namespace {

constexpr int kSecondsMax = 3600;

int doctor_main(int argc, char** argv) {
  DoctorOptions options;
  options.folder = ".";
  options.seconds = 3;
  std::string url;
  return run_main(
      argc, argv,
      {.name = "treeroll-doctor",
       .purpose =
           "Says what is wrong with this host, its network and who is on the group, and what to "
           "do about it. Learns nothing, changes nothing; may run beside a study.",
       .examples = {{"treeroll-doctor", "this host, its network, and who is on the group"}},
       .options =
           [&](CommandLine& line) {
             line.add(
                 "--lcm-url", url,
                 "LCM URL; default: LCM_DEFAULT_URL, else LCM's default, which stays on this host");
             line.add("--key-file", options.key_file,
                      "Keys of treeroll-keygen, where the group has some. A learner's: signs, and "
                      "says who does not. A worker's: says which learners its worker refuses");
             line.add("--folder", options.folder, "Where results go: its disk is looked at")
                 .shows_default();
             line.add("--seconds", options.seconds, "How long to listen to the group")
                 .between(1, kSecondsMax)
                 .shows_default();
             line.add("--json", options.json, "Print the findings as JSON");
             line.end_help_with("Status: 0 nothing is in trouble, 1 something is.");
           },
       .work =
           [&] {
             options.lcm_url = transport::resolve_url(url);
             return examine(options) ? kExitDone : kExitOther;
           }});
}

}  // namespace
}  // namespace treeroll::doctor

int main(int argc, char** argv) { return treeroll::doctor::doctor_main(argc, argv); }
