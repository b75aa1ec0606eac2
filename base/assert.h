// Checked assumptions of the code. They detect programming errors only: bad input is reported as a fault (base/faults.h), numerical trouble as a flag of the
// step.
//
//   SEL_ASSERT(condition, "what is assumed")     in debug, sanitized and CI builds (SELDINGER_ASSERTS); elsewhere it is compiled but never evaluated
//   SEL_REQUIRE(condition, "what is assumed")    in every build: cheap checks whose violation would overwrite memory or falsify results
//   SEL_VALIDATE(condition, "what is assumed")   in builds with SELDINGER_VALIDATE: loops over everything that a step has produced
//
// A violated assumption prints `FILE:LINE: assertion failed: CONDITION; assumed: TEXT` to stderr and aborts, so that a debugger or a core file shows where.
// A condition must have no side effects.
#ifndef SELDINGER_BASE_ASSERT_H
#define SELDINGER_BASE_ASSERT_H

#ifdef __cplusplus
extern "C" {
#endif

__attribute__((noreturn, cold)) void sel_assert_failed(const char *file, int line, const char *condition, const char *assumed);

#ifdef __cplusplus
}
#endif

#define SEL_REQUIRE(condition, assumed) (__builtin_expect(!(condition), 0) ? sel_assert_failed(__FILE__, __LINE__, #condition, assumed) : (void)0)
#define SEL_UNCHECKED(condition, assumed) ((void)sizeof(!(condition)), (void)sizeof(assumed))

#ifndef SELDINGER_ASSERTS
#define SELDINGER_ASSERTS 0
#endif
#ifndef SELDINGER_VALIDATE
#define SELDINGER_VALIDATE 0
#endif

#if SELDINGER_ASSERTS
#define SEL_ASSERT(condition, assumed) SEL_REQUIRE(condition, assumed)
#else
#define SEL_ASSERT(condition, assumed) SEL_UNCHECKED(condition, assumed)
#endif

#if SELDINGER_VALIDATE
#define SEL_VALIDATE(condition, assumed) SEL_REQUIRE(condition, assumed)
#else
#define SEL_VALIDATE(condition, assumed) SEL_UNCHECKED(condition, assumed)
#endif

#endif
