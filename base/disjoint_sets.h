// Disjoint sets (union-find): following parent[i] leads to the lowest member of i's set, which is its own parent. Initially parent[i] = i.
#ifndef SELDINGER_BASE_DISJOINT_SETS_H
#define SELDINGER_BASE_DISJOINT_SETS_H

static inline int disjoint_root(int *parent, int i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static inline void disjoint_join(int *parent, int i, int k)
{
    int a = disjoint_root(parent, i), b = disjoint_root(parent, k);
    parent[a > b ? a : b] = a > b ? b : a;
}

#endif
