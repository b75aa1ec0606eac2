// The host's allocator. The linker sends the library's calls of malloc and its relatives here (--wrap, see CMakeLists.txt), so that no other source knows of it.
#ifndef SELDINGER_SIM_LIBRARY_ALLOCATOR_H
#define SELDINGER_SIM_LIBRARY_ALLOCATOR_H

// From now on it cannot be replaced.
void allocator_settle(void);

#endif
