// A value that threads share without locks, in headers that C++ reads too: ATOMIC(int) count. gcc and clang give it the same size and layout in both.
#ifndef SELDINGER_BASE_ATOMIC_H
#define SELDINGER_BASE_ATOMIC_H

#ifdef __cplusplus
#include <atomic>
#define ATOMIC(type) std::atomic<type>
#else
#include <stdatomic.h>
#define ATOMIC(type) _Atomic(type)
#endif

#endif
