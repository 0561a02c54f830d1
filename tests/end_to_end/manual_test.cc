// Man pages, and what completes in a shell: both from the options that --help lists.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// The long options that a text names.
std::set<std::string> options_in(std::string text) {
  // As roff has them.
  for (auto at = text.find("\\-"); at != std::string::npos; at = text.find("\\-", at)) {
    text.erase(at, 1);
  }
  std::set<std::string> options;
  const std::regex option("--[a-z][a-z-]+");
  for (std::sregex_iterator i(text.begin(), text.end(), option), end; i != end; ++i) {
    options.insert(i->str());
  }
  return options;
}

TEST(ManualTest, PageAndCompletionHaveEveryOptionOfTheHelp) {
  const Service service;
  for (const char* program :
       {"treeroll-evaluate", "treeroll-learner", "treeroll-replay", "treeroll-worker"}) {
    SCOPED_TRACE(program);
    const Said help = service.run(program, {"--help"});
    EXPECT_THAT(help.output, HasSubstr("Examples:\n  " + std::string(program)));
    const std::set<std::string> options = options_in(help.output);
    EXPECT_GE(options.size(), 5U);
    const Said page = service.run(program, {"--help-man"});
    EXPECT_EQ(page.status, 0) << page.errors;
    EXPECT_THAT(page.output, AllOf(HasSubstr(".SH OPTIONS\n.TP\n"), HasSubstr(".SH EXAMPLES\n")));
    EXPECT_EQ(options_in(page.output), options);
    for (const std::string shell : {"bash", "fish", "zsh"}) {
      const Said said = service.run(program, {"--help-completion", shell});
      EXPECT_EQ(said.status, 0) << said.errors;
      // fish has "-l log" for "--log".
      const std::string completion =
          shell == "fish" ? std::regex_replace(said.output, std::regex(" -l "), " --")
                          : said.output;
      std::istringstream lines(page.output);
      for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("\\fB\\-\\-")) continue;
        EXPECT_THAT(options_in(completion), IsSupersetOf(options_in(line))) << shell;
      }
    }
  }
}

TEST(ManualTest, ThePageSaysWhichArgumentsMayBeLeftOut) {
  const Service service;
  for (const auto& [program, arguments] : {std::pair{"learner", "[\\fISTUDY\\fR]"},
                                           {"replay", "\\fIPATH\\fR"},
                                           {"evaluate", "\\fIPOLICY\\fR \\fISTUDY\\fR"}}) {
    const Said page = service.run("treeroll-" + std::string(program), {"--help-man"});
    EXPECT_THAT(page.output, HasSubstr(std::string("[\\fIOPTIONS\\fR] ") + arguments + "\n"));
  }
}

/// Those who press Tab, each in a shell of its own that has read the learner's completion.
class CompletionTest : public ::testing::Test {
 protected:
  /// What a script of the shell prints, with the completion's file as its first argument.
  std::string printed(const std::string& shell, const std::string& script,
                      const std::string& words) {
    const std::string file = (service_.directory() / "_treeroll-learner").string();
    write_file(file, service_.run("treeroll-learner", {"--help-completion", shell}).output);
    const std::string script_path = (service_.directory() / "script").string();
    write_file(script_path, script);
    Daemon daemon("/usr/bin/" + shell, {script_path, file, words}, service_.directory(),
                  {{"HOME", service_.directory().string()}, {"TERM", "xterm"}});
    EXPECT_EQ(daemon.wait(std::chrono::seconds(60)), 0) << daemon.standard_error();
    return daemon.standard_output();
  }

  Service service_;
};

TEST_F(CompletionTest, BashCompletesOptionsAndTheirWords) {
  const std::string script =
      "source $1; COMP_WORDS=(treeroll-learner $2); COMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
      "_treeroll_learner; echo \"${COMPREPLY[*]}\"\n";
  EXPECT_EQ(printed("bash", script, "--sta"), "--state-dir\n");
  EXPECT_EQ(printed("bash", script, "study.toml --log j"), "json\n");
  EXPECT_EQ(printed("bash", script, "--log = j"), "json\n");  // as bash parts --log=j
}

TEST_F(CompletionTest, BashCompletesANameWithABlankAsOne) {
  write_file(service_.directory() / "my study.toml", "");
  const std::string script =
      "source $1; cd ${1%/*}; COMP_WORDS=(treeroll-learner $2); COMP_CWORD=1\n"
      "_treeroll_learner; printf '<%s>' \"${COMPREPLY[@]}\"\n";
  EXPECT_EQ(printed("bash", script, "my"), "<my study.toml>");
}

TEST_F(CompletionTest, FishCompletesOptionsAndTheirWords) {
  if (!fs::exists("/usr/bin/fish")) GTEST_SKIP() << "no fish: deploy/install-packages shells";
  const std::string script = "source $argv[1]; complete -C \"treeroll-learner $argv[2]\"\n";
  EXPECT_THAT(printed("fish", script, "--sta"), HasSubstr("--state-dir\tEmpty or new directory"));
  EXPECT_THAT(printed("fish", script, "study.toml --log "),
              AllOf(HasSubstr("json\t"), HasSubstr("text\t")));
  EXPECT_THAT(printed("fish", script, "--salvage --local-workers "), Not(HasSubstr("script")));
}

TEST_F(CompletionTest, ZshCompletesOptionsAndTheirWords) {
  if (!fs::exists("/usr/bin/zsh")) GTEST_SKIP() << "no zsh: deploy/install-packages shells";
  // Only a shell that is typed into completes: it has a terminal, into which words and a tab go.
  // What is typed before the editor has shown its prompt would come back as it is.
  const std::string script = R"(
zmodload zsh/zpty
hear() {
  for i in {1..400}; do
    while zpty -r -t typed part; do said+=$part; done
    [[ $said == *$1* ]] && return
    sleep .05
  done
}
zpty -b typed zsh -f -i
zpty -w typed "PS1=PRO''MPT; fpath=(${1:h} \$fpath); autoload -Uz compinit; compinit -u -D"
hear PROMPT
zpty -w -n typed "treeroll-learner $2"$'\t'
zpty -w -n typed ' END'
hear END
print -r -- "$said"
zpty -d typed
)";
  EXPECT_THAT(printed("zsh", script, "--sta"), HasSubstr("treeroll-learner --state-dir"));
  EXPECT_THAT(printed("zsh", script, "study.toml --log j"), HasSubstr("study.toml --log json"));
}

TEST(ManualTest, AnUnknownShellIsNamedWithThoseThereAre) {
  const Service service;
  const Said said = service.run("treeroll-learner", {"--help-completion", "tcsh"});
  EXPECT_EQ(said.status, 2);
  EXPECT_THAT(said.errors, HasSubstr("tcsh not in {bash,fish,zsh}"));
}

}  // namespace
}  // namespace treeroll::end_to_end
