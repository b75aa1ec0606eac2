// The host's allocator. The linker redirects the library's calls of malloc and related functions here (--wrap, see CMakeLists.txt), so that no other source
// depends on it.
#ifndef SELDINGER_SIM_LIBRARY_ALLOCATOR_H
#define SELDINGER_SIM_LIBRARY_ALLOCATOR_H

// Fixes the allocator: it cannot be replaced afterwards.
void allocator_settle(void);

#endif
