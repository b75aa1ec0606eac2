// A value that threads share without locks, for headers that C++ also includes: ATOMIC(int) count. With gcc and clang it has the same size and layout in C and
// C++.
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
