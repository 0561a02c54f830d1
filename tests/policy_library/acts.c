/* A program in C that acts with a policy. On standard input: the policy's text as one line, then
 * lines of numbers: "theta" and theta_dim numbers, or "act" and input_dim numbers, a roll-out of
 * its own; "and" with such numbers goes on with the roll-out; "names". On standard
 * output, line by line: what the policy gives, in hexadecimal; "error: REASON" where it gives none.
 * At the end of the input it tries what a wrong caller does. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "treeroll/policy.h"

#define NUMBERS_MAX 5000
#define LINE_MAX_BYTES (4 << 20)

static size_t read_numbers(char *text, double *numbers) {
  size_t count = 0;
  char *end = text;
  for (;;) {
    const double number = strtod(text, &end);
    if (end == text || count == NUMBERS_MAX) return count;
    numbers[count++] = number;
    text = end;
  }
}

static void print_numbers(const double *numbers, size_t count) {
  for (size_t i = 0; i < count; ++i) printf(i == 0 ? "%a" : " %a", numbers[i]);
  printf("\n");
}

static void print_error(void) { printf("error: %s\n", treeroll_policy_last_error()); }

static int wrong_calls(treeroll_policy *policy) {
  double numbers[2] = {0, 0};
  int num_taken = 0;
  num_taken += treeroll_policy_load(NULL) != NULL;
  num_taken += treeroll_policy_load("") != NULL;
  num_taken += treeroll_policy_load("{\"format\": \"treeroll-policy\"}") != NULL;
  num_taken += treeroll_policy_act(NULL, numbers, 1, numbers, 1) == 0;
  num_taken += treeroll_policy_act(policy, NULL, 1, numbers, 1) == 0;
  num_taken += treeroll_policy_act(policy, numbers, 99, numbers, 1) == 0;
  num_taken += treeroll_policy_set_theta(policy, numbers, 0) == 0;
  num_taken += treeroll_policy_get_theta(policy, NULL, 0) == 0;
  num_taken += treeroll_policy_start(NULL) == 0;
  num_taken += treeroll_policy_text(NULL, NULL, 0) != 0;
  num_taken += treeroll_policy_input_dim(NULL) != 0;
  num_taken += treeroll_policy_input_name(NULL, 0)[0] != 0;
  num_taken += treeroll_policy_output_name(NULL, 0)[0] != 0;
  treeroll_policy_free(NULL);
  return num_taken;
}

int main(void) {
  static char line[LINE_MAX_BYTES];
  static double numbers[NUMBERS_MAX];
  double output[NUMBERS_MAX];
  treeroll_policy *policy;
  if (fgets(line, sizeof line, stdin) == NULL) return 1;
  policy = treeroll_policy_load(line);
  if (policy == NULL) {
    print_error();
    return 0;
  }
  printf("dims %zu %zu %zu\n", treeroll_policy_input_dim(policy), treeroll_policy_output_dim(policy),
         treeroll_policy_theta_dim(policy));
  while (fgets(line, sizeof line, stdin) != NULL) {
    if (strncmp(line, "theta", 5) == 0) {
      const size_t count = read_numbers(line + 5, numbers);
      if (treeroll_policy_set_theta(policy, numbers, count) != 0) print_error();
    } else if (strncmp(line, "get", 3) == 0) {
      const size_t count = treeroll_policy_theta_dim(policy);
      if (treeroll_policy_get_theta(policy, numbers, count) == 0) print_numbers(numbers, count);
    } else if (strncmp(line, "names", 5) == 0) {
      for (size_t i = 0; i <= treeroll_policy_input_dim(policy); ++i)
        printf("%s ", treeroll_policy_input_name(policy, i));
      for (size_t i = 0; i <= treeroll_policy_output_dim(policy); ++i)
        printf("> %s", treeroll_policy_output_name(policy, i));
      printf("\n");
    } else if (strncmp(line, "text", 4) == 0) {
      const size_t size = treeroll_policy_text(policy, NULL, 0);
      char *text = malloc(size);
      if (text == NULL || treeroll_policy_text(policy, text, size) != size) return 1;
      printf("%s\n", text);
      free(text);
    } else {
      const size_t count = read_numbers(line + 3, numbers);
      const size_t num_outputs = treeroll_policy_output_dim(policy);
      if (strncmp(line, "act", 3) == 0) treeroll_policy_start(policy);
      if (treeroll_policy_act(policy, numbers, count, output, num_outputs) == 0) {
        print_numbers(output, num_outputs);
      } else {
        print_error();
      }
    }
  }
  printf("%d wrong calls were taken\n", wrong_calls(policy));
  treeroll_policy_free(policy);
  return 0;
}
