// The jobs of deploy/slurm on a real Slurm: slurmctld, two slurmd and munged on a host of its own,
// in a temporary folder. A task is cancelled and a node drained, and the files are the same.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kCpusPerNode = 3;

bool is_installed(const std::string& program) {
  for (const char* folder : {"/usr/sbin", "/usr/bin", "/usr/local/sbin", "/usr/local/bin"}) {
    if (access(fmt::format("{}/{}", folder, program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

class SlurmTest : public NetworkTest {
 protected:
  void SetUp() override {
    NetworkTest::SetUp();
    if (IsSkipped()) return;
    for (const char* program : {"munged", "slurmctld", "slurmd", "sbatch", "scancel", "scontrol"}) {
      if (!is_installed(program)) GTEST_SKIP() << program << " is not installed";
    }
    if (geteuid() != 0) GTEST_SKIP() << "slurmd runs jobs of others: as root only";
    start_cluster();
  }

  void TearDown() override {
    if (!network_) return;
    command("scancel", {"--user", "root"});
    eventually(seconds(20), [&] { return queue().empty(); });
    // Steps have shepherds of their own, which end with their jobs.
    for (auto* daemon : {&node_one_, &node_two_, &controller_, &munge_}) {
      if (!*daemon) continue;
      (*daemon)->kill(SIGTERM);
      (*daemon)->wait(seconds(10));
    }
  }

  /// Runs a program of Slurm to its end.
  Said command(const std::string& program, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), program);
    Daemon process("/usr/bin/env", arguments, service_.directory(), environment_,
                   network_->host(0));
    const int status = process.wait(seconds(30));
    return {status, process.standard_output(), process.standard_error()};
  }
  std::string output(const std::string& program, const std::vector<std::string>& arguments) const {
    const Said said = command(program, arguments);
    EXPECT_EQ(said.status, 0) << program << ": " << said.errors;
    return said.output;
  }
  /// @return the job's number
  std::string submit(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--parsable", "--export=ALL"});
    std::string job = output("sbatch", arguments);
    while (!job.empty() && job.back() == '\n') job.pop_back();
    return job;
  }
  /// Lines "JOB_TASK NAME STATE NODE" of what waits or runs.
  std::string queue() const {
    return command("squeue", {"--noheader", "--array", "--format=%i %j %T %N"}).output;
  }
  std::string log_of(const std::string& name) const {
    return read_file(service_.directory() / name);
  }
  static std::string deploy(const std::string& file) {
    return (fs::path(TREEROLL_SOURCE_DIR) / "deploy" / file).string();
  }

  std::unique_ptr<Network> network_;
  std::map<std::string, std::string> environment_;

 private:
  std::unique_ptr<Daemon> start(const std::vector<std::string>& words) const {
    return std::make_unique<Daemon>("/usr/bin/env", words, service_.directory(), environment_,
                                    network_->host(0));
  }

  void start_cluster() {
    network_ = std::make_unique<Network>(1);
    const std::string folder = service_.directory().string();
    fs::permissions(folder, fs::perms(0755));
    char host[256] = {};
    ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
    const std::string name(host, std::find(host, host + sizeof host, '.') - host);
    for (const char* made : {"state", "spool-one", "spool-two"}) {
      fs::create_directory(service_.directory() / made);
    }
    std::random_device random;
    std::string key;
    for (int i = 0; i < 128; ++i) key.push_back(static_cast<char>(random()));
    write_file(service_.directory() / "munge.key", key);
    fs::permissions(service_.directory() / "munge.key", fs::perms(0600));
    write_file(service_.directory() / "slurm.conf", fmt::format(R"(ClusterName=treeroll
SlurmctldHost={0}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={1}/munge.socket
CredType=cred/munge
StateSaveLocation={1}/state
SlurmdSpoolDir={1}/spool-%n
SlurmctldPidFile={1}/controller.pid
SlurmdPidFile={1}/node-%n.pid
SlurmctldLogFile={1}/controller.log
SlurmdLogFile={1}/node-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1,batch_sched_delay=1
KillWait=20
NodeName=one NodeHostname={0} NodeAddr=127.0.0.1 Port=16818 CPUs={2}
NodeName=two NodeHostname={0} NodeAddr=127.0.0.1 Port=16819 CPUs={2}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
)",
                                                                name, folder, kCpusPerNode));
    environment_ = {
        {"SLURM_CONF", folder + "/slurm.conf"},
        {"LCM_DEFAULT_URL", Network::url()},
        {"TREEROLL_DEPLOY", deploy("")},
        {"TREEROLL_IDLE_S", "20"},
        {"PATH", executable("").parent_path().string() + ":/usr/sbin:/usr/bin:/sbin:/bin"}};
    const auto in = [&](const char* file) { return folder + "/" + file; };
    munge_ = start({"munged", "--foreground", "--force", "--key-file=" + in("munge.key"),
                    "--socket=" + in("munge.socket"), "--pid-file=" + in("munge.pid"),
                    "--log-file=" + in("munge.log"), "--seed-file=" + in("munge.seed")});
    ASSERT_TRUE(eventually(seconds(10), [&] { return fs::exists(in("munge.socket")); }))
        << munge_->standard_error();
    controller_ = start({"slurmctld", "-D"});
    node_one_ = start({"slurmd", "-D", "-N", "one"});
    node_two_ = start({"slurmd", "-D", "-N", "two"});
    ASSERT_TRUE(
        eventually(seconds(60),
                   [&] {
                     return command("sinfo", {"--noheader", "--format=%T %D"}).output == "idle 2\n";
                   }))
        << command("sinfo", {}).output << log_of("controller.log") << log_of("node-one.log");
  }

  std::unique_ptr<Daemon> munge_;
  std::unique_ptr<Daemon> controller_;
  std::unique_ptr<Daemon> node_one_;
  std::unique_ptr<Daemon> node_two_;
};

TEST_F(SlurmTest, ATaskCancelledAndANodeDrainedLeaveNoTraceInTheFiles) {
  const fs::path study = service_.study(patient_study(100, 40'000));
  const Files files = learnt_alone(study, kAtOnce);
  const std::string folder = service_.directory().string();
  const std::string workers = submit(
      {"--array=1-6", "--output=" + folder + "/worker-%a.log", deploy("slurm/workers.sbatch")});
  const std::string learner =
      submit({"--output=" + folder + "/learner.log", deploy("slurm/learner.sbatch"), study.string(),
              state("learnt").string()});
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << log_of("learner.log") << queue();

  command("scancel", {workers + "_1"});
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << log_of("learner.log") << queue();
  EXPECT_THAT(log_of("worker-1.log"), HasSubstr("draining, asked to stop"));

  output("scontrol", {"update", "NodeName=two", "State=DRAIN", "Reason=a test"});
  output("scancel", {"--nodelist=two", "--name=treeroll-worker"});
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << log_of("learner.log") << queue();
  EXPECT_TRUE(eventually(seconds(30), [&] {
    return output("sinfo", {"--noheader", "--nodes=two", "--format=%T"}).starts_with("drain");
  })) << queue();

  // The learner's job is asked to end, and the same command goes on.
  if (queue().find(learner + " treeroll-learner RUNNING") != std::string::npos) {
    output("scancel", {"--signal=TERM", "--full", learner});
    ASSERT_TRUE(eventually(seconds(30), [&] {
      return queue().find("treeroll-learner") == std::string::npos;
    })) << queue();
    submit({"--output=" + folder + "/learner-2.log", deploy("slurm/learner.sbatch"), study.string(),
            state("learnt").string()});
  }
  ASSERT_TRUE(eventually(seconds(120),
                         [&] {
                           return fs::exists(state("learnt") / "runs.csv") &&
                                  queue().find("treeroll-learner") == std::string::npos;
                         }))
      << log_of("learner.log") << log_of("learner-2.log") << queue();
  EXPECT_TRUE(eventually(seconds(60), [&] { return queue().empty(); }))
      << "workers end by themselves\n"
      << queue();
  EXPECT_EQ(read_file(state("learnt") / "rollouts.csv"), files.rollouts_csv)
      << log_of("learner-2.log");
  EXPECT_EQ(read_file(state("learnt") / "runs.csv"), files.runs_csv);
  expect_verified("learnt");
}

}  // namespace
}  // namespace treeroll::end_to_end
