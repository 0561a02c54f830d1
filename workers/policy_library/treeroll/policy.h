/* Policies of treeroll for programs in any language: one reads a policy that was learnt, or that a
 * worker hands on (EVALUATOR.md), and acts with it, to the same bits as treeroll itself.
 *
 *   treeroll_policy *policy = treeroll_policy_load(json);
 *   if (!policy) fail(treeroll_policy_last_error());
 *   treeroll_policy_start(policy);
 *   for (...) treeroll_policy_act(policy, &time_s, 1, &cart_acceleration_mps2, 1);
 *   treeroll_policy_free(policy);
 *
 * A policy belongs to one thread at a time; different policies may be used in different threads.
 * Nothing here ends the process or prints. Functions that can fail return NULL or -1 and leave the
 * reason in treeroll_policy_last_error(). Link with -ltreeroll_policy (pkg-config treeroll_policy).
 */
#pragma once

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define TREEROLL_API __attribute__((visibility("default")))
#else
#define TREEROLL_API
#endif

/* A policy with a theta, and what acts with it. */
typedef struct treeroll_policy treeroll_policy;

/* The version of treeroll that this library is of: "0.2.0". */
TREEROLL_API const char* treeroll_policy_version(void);

/* Why the last call in this thread failed: one line; "" if none has failed. Valid until the next
 * call in this thread that fails. */
TREEROLL_API const char* treeroll_policy_last_error(void);

/* A policy from its text: the contents of a policy file, or the value of "policy" that an evaluator
 * is given. NULL if it is none. To be freed. */
TREEROLL_API treeroll_policy* treeroll_policy_load(const char* json);

/* NULL is allowed. */
TREEROLL_API void treeroll_policy_free(treeroll_policy* policy);

/* How many numbers it acts on, gives, and learns; 0 for NULL. */
TREEROLL_API size_t treeroll_policy_input_dim(const treeroll_policy* policy);
TREEROLL_API size_t treeroll_policy_output_dim(const treeroll_policy* policy);
TREEROLL_API size_t treeroll_policy_theta_dim(const treeroll_policy* policy);

/* What its task calls input or output number `index`, from 0, with the unit last: "time_s". ""
 * where the policy's text has no names, for NULL, and past the last one. Valid until the policy is
 * freed. */
TREEROLL_API const char* treeroll_policy_input_name(const treeroll_policy* policy, size_t index);
TREEROLL_API const char* treeroll_policy_output_name(const treeroll_policy* policy, size_t index);

/* Theta as the policy stands. Precondition: size is theta_dim. Returns 0 or -1. */
TREEROLL_API int treeroll_policy_get_theta(const treeroll_policy* policy, double* theta,
                                           size_t size);

/* From now on the policy has this theta: theta_dim finite numbers. Where there is no such policy,
 * for a theta so extreme, it stays as it was. In the midst of a roll-out what bounds the rate of
 * the outputs goes on from the last output. Returns 0 or -1. */
TREEROLL_API int treeroll_policy_set_theta(treeroll_policy* policy, const double* theta,
                                           size_t size);

/* To be called before each roll-out: a policy with a state of its own begins anew,
 * and what bounds the rate of its outputs forgets the last one: never to be called in motion. */
TREEROLL_API int treeroll_policy_start(treeroll_policy* policy);

/* What the policy gives for an input, in the units of its task: input_dim finite numbers in,
 * output_dim numbers out, finite. Returns 0 or -1; then the output is not written. */
TREEROLL_API int treeroll_policy_act(treeroll_policy* policy, const double* input,
                                     size_t input_size, double* output, size_t output_size);

/* The policy's text as it stands now, theta included, with a NUL at its end: what a policy file
 * holds. At most `size` bytes are written, the NUL among them; nothing if it does not fit.
 * Returns how many bytes it takes, or 0 for a failure. */
TREEROLL_API size_t treeroll_policy_text(const treeroll_policy* policy, char* text, size_t size);

#ifdef __cplusplus
}
#endif
