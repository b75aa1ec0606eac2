// Direction numbers of a dimension: m_1 … m_s are given; with the primitive polynomial x^s + a_1 x^(s-1) + … + a_(s-1) x + 1 over GF(2)
//   m_k = 2 a_1 m_(k-1) ^ 4 a_2 m_(k-2) ^ … ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s),    v_k = m_k 2^(32-k).
// Point n is the exclusive or of the v_k at the digits of n ^ (n >> 1). Joe and Kuo, SIAM J. Sci. Comput. 30 (2008) 2635.
#include "study/sobol.h"

#include "base/base.h"

enum { DIGITS = 32, DEGREE_MOST = 7 };

typedef struct Polynomial {
    int s;                   // degree
    unsigned a;              // a_1 … a_(s-1), a_1 the highest digit
    uint32_t m[DEGREE_MOST]; // m_1 … m_s, odd, m_k < 2^k
} Polynomial;

// dimensions 2 to 20; in dimension 1 all m are 1
static const Polynomial polynomial[SOBOL_DIMENSIONS - 1] = {
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
};

static void directions(int dimension, uint32_t v[DIGITS])
{
    for (int k = 0; dimension == 0 && k < DIGITS; k++)
        v[k] = UINT32_C(1) << (DIGITS - 1 - k);
    if (dimension == 0)
        return;
    const Polynomial *p = &polynomial[dimension - 1];
    for (int k = 0; k < DIGITS; k++) {
        if (k < p->s) {
            v[k] = p->m[k] << (DIGITS - 1 - k);
            continue;
        }
        v[k] = v[k - p->s] ^ (v[k - p->s] >> p->s);
        for (int i = 1; i < p->s; i++)
            if (p->a >> (p->s - 1 - i) & 1)
                v[k] ^= v[k - i];
    }
}

uint32_t sobol_digits(uint32_t index, int dimension)
{
    SEL_ASSERT(dimension >= 0 && dimension < SOBOL_DIMENSIONS, "the table has this dimension");
    uint32_t v[DIGITS], gray = index ^ (index >> 1), x = 0;
    directions(dimension, v);
    for (int k = 0; k < DIGITS; k++)
        if (gray >> k & 1)
            x ^= v[k];
    return x;
}

double sobol_unit(uint32_t index, int dimension, uint32_t shift) { return ((double)(sobol_digits(index, dimension) ^ shift) + 0.5) * 0x1p-32; }
