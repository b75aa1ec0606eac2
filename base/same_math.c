// Taylor series, truncated where the next term is below a tenth of the last bit; arguments are first reduced to near zero. Where the reduction or a sum would
// lose more than
// the last bit, numbers are kept as a sum of two doubles, high + low, with |low| at most half a unit in the last place of high (Dekker, A floating-point
// technique for
// extending the available precision, Numerische Mathematik 18, 1971).
#include "base/same_math.h"

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

typedef struct Pair {
    double high, low;
} Pair;

// a + b, exactly.
static Pair sum_of(double a, double b)
{
    double s = a + b, part = s - a;
    return (Pair){s, (a - (s - part)) + (b - part)};
}

// a + b, exactly, if |a| >= |b|.
static Pair quick_sum(double a, double b)
{
    double s = a + b;
    return (Pair){s, b - (s - a)};
}

// The first 26 bits of x.
static double first_half(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits &= UINT64_C(0xfffffffff8000000);
    memcpy(&x, &bits, sizeof bits);
    return x;
}

// a b, exactly unless a partial product underflows.
static Pair product_of(double a, double b)
{
    double p = a * b, ah = first_half(a), al = a - ah, bh = first_half(b), bl = b - bh;
    return (Pair){p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
}

static Pair pair_add(Pair a, Pair b)
{
    Pair s = sum_of(a.high, b.high);
    return quick_sum(s.high, s.low + (a.low + b.low));
}

static Pair pair_mul(Pair a, Pair b)
{
    Pair p = product_of(a.high, b.high);
    return quick_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

static Pair pair_div(Pair a, Pair b)
{
    double q = a.high / b.high;
    Pair back = product_of(q, b.high);
    return quick_sum(q, (((a.high - back.high) - back.low) + (a.low - q * b.low)) / b.high);
}

// 2^k, k from -1022 to 1023.
static double power_of_two(int k)
{
    uint64_t bits = (uint64_t)(1023 + k) << 52;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

// The nearest integer to x, |x| below 2^51. Assumes rounding to nearest, which no code here changes.
static double nearest(double x)
{
    const double shift = 0x1.8p52;
    double shifted = x + shift;
    return shifted - shift;
}

// --- sine and cosine ---

static const Pair half_pi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54}, pi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
// The first 1280 bits of 2 / pi behind 64 zeros.
static const uint32_t two_over_pi[42] = {0,          0,          0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041, 0xfe5163ab,
                                         0xdebbc561, 0xb7246e3a, 0x424dd2e0, 0x06492eea, 0x09d1921c, 0xfe1deb1c, 0xb129a73e, 0xe88235f5, 0x2ebb4484,
                                         0xe99c7026, 0xb45f7e41, 0x3991d639, 0x835339f4, 0x9c845f8b, 0xbdf9283b, 0x1ff897ff, 0xde05980f, 0xef2f118b,
                                         0x5a0a6d1f, 0x6d367ecf, 0x27cb09b7, 0x4f463f66, 0x9e5fea2d, 0x7527bac7, 0xebe5f17b, 0x3d0739f7, 0x8a5292ea,
                                         0x6bfb5fb1, 0x1f8d5d08, 0x56033046, 0xfc7b6bab, 0xf0cfbc20, 0x9af4361d};

// x = m 2^e, m an integer. Only 192 bits of 2 / pi affect m 2^e 2 / pi modulo 4: those of weight 2^(1 - e) and less (Payne and Hanek, Radian reduction for
// trigonometric functions, SIGNUM Newsletter 18, 1983).
static int reduce_large(double x, Pair *rest)
{
    int exponent;
    uint64_t m = (uint64_t)ldexp(frexp(fabs(x), &exponent), 53), product[6] = {0};
    int first = exponent - 53 - 2 + 64;
    for (int part = 0; part < 2; part++) {
        uint64_t factor = part == 0 ? (uint32_t)m : m >> 32, carry = 0;
        for (int i = 5; i >= part; i--) {
            int at = (first + 32 * i) / 32, shift = (first + 32 * i) % 32;
            uint32_t word = (uint32_t)(((uint64_t)two_over_pi[at] << 32 | two_over_pi[at + 1]) >> (32 - shift));
            uint64_t sum = factor * word + product[i - part] + carry;
            product[i - part] = (uint32_t)sum;
            carry = sum >> 32;
        }
    }
    int quarter = (int)(product[0] >> 30);
    double part[5];
    for (int i = 0; i < 5; i++)
        part[i] = (double)(uint32_t)(product[i] << 2 | product[i + 1] >> 30);
    double beyond = part[0] >= 0x1p31;                                // nearer to the next quadrant
    Pair turn = sum_of(part[0] * 0x1p-32 - beyond, part[1] * 0x1p-64);
    turn = sum_of(turn.high, turn.low + (part[2] * 0x1p-96 + (part[3] * 0x1p-128 + part[4] * 0x1p-160)));
    *rest = pair_mul(turn, half_pi);
    quarter += (int)beyond;
    if (x < 0)
        *rest = (Pair){-rest->high, -rest->low}, quarter = -quarter;
    return quarter & 3;
}

// x = quarter pi / 2 + rest, |rest| at most slightly above pi / 4. Returns quarter modulo 4.
static int reduce(double x, Pair *rest)
{
    // pi / 2 as three parts of 33 bits and a remainder: k times a part is exact
    const double part1 = 0x1.921fb544p+0, part2 = 0x1.0b4611a6p-34, part3 = 0x1.3198a2ep-69, part4 = 0x1.b839a252049c1p-104;
    if (fabs(x) > 1e6)
        return reduce_large(x, rest);
    double k = nearest(x * (1 / 0x1.921fb54442d18p+0));
    Pair a = sum_of(x - k * part1, -k * part2), b = sum_of(a.high, -k * part3);
    *rest = quick_sum(b.high, b.low + (a.low - k * part4));
    return (int)k & 3;
}

static double near_sine(Pair r)
{
    double x = r.high, z = x * x, series = 1.0 / 6227020800 - z * (1.0 / 1307674368000 - z * (1.0 / 355687428096000));
    series = 1.0 / 120 - z * (1.0 / 5040 - z * (1.0 / 362880 - z * (1.0 / 39916800 - z * series)));
    return x + (r.low * (1 - 0.5 * z) - z * x * (1.0 / 6 - z * series));
}

static double near_cosine(Pair r)
{
    double x = r.high, z = x * x, series = 1.0 / 479001600 - z * (1.0 / 87178291200 - z * (1.0 / 20922789888000 - z * (1.0 / 6402373705728000)));
    series = 1.0 / 24 - z * (1.0 / 720 - z * (1.0 / 40320 - z * (1.0 / 3628800 - z * series)));
    double half = 0.5 * z, w = 1 - half;
    return w + (((1 - w) - half) + (z * z * series - x * r.low));
}

// The sine of x + quarters pi / 2.
static double sine_from(double x, int quarters)
{
    Pair rest = {x, 0};
    if (!(fabs(x) < HUGE_VAL))
        return x - x;
    if (fabs(x) > 0.78)
        quarters += reduce(x, &rest);
    double value = quarters & 1 ? near_cosine(rest) : near_sine(rest);
    return quarters & 2 ? -value : value;
}

double same_sin(double x) { return x == 0 ? x : sine_from(x, 0); }      // keeps the sign of zero
double same_cos(double x) { return sine_from(x, 1); }

// --- arc functions ---

// atan(i / 16)
static const Pair arc[17] = {{0, 0},
                             {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
                             {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
                             {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
                             {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                             {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
                             {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
                             {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
                             {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                             {0x1.0657e94db30d0p-1, -0x1.d5b495f6349e6p-56},
                             {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
                             {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
                             {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                             {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
                             {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
                             {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
                             {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};

// z - atan z, for |z| below 1 / 31.
static double beyond_arc(double z)
{
    double q = z * z;
    return z * q * (1.0 / 3 - q * (1.0 / 5 - q * (1.0 / 7 - q * (1.0 / 9 - q * (1.0 / 11)))));
}

// With t = least / most = i / 16 + d: atan t = atan(i / 16) + atan z, z = (least - i / 16 most) / (most + i / 16 least), |z| below 1 / 31.
double same_atan2(double y, double x)
{
    double least = fabs(y), most = fabs(x);
    bool steep = least > most;
    // fast path for the common case, the twist of an element: as below with i = 0, in half the time
    if (least < 0x1p-5 * x && x < 0x1p1000 && x > 0x1p-900) {
        if (y == 0)
            return y;
        double z = least / x, inverse = 1 / x;
        Pair back = product_of(z, x);
        return copysign(z + (((least - back.high) - back.low) * inverse - beyond_arc(z)), y);
    }
    if (!(least <= HUGE_VAL && most <= HUGE_VAL))
        return x + y;
    if (steep)
        most = least, least = fabs(x);
    if (most > DBL_MAX)
        least = least > DBL_MAX, most = 1;
    else if (most > 0x1p1000)
        least *= 0x1p-100, most *= 0x1p-100;
    else if (most < 0x1p-900)
        least *= 0x1p120, most = most > 0 ? most * 0x1p120 : 1;
    int i = (int)(16 * (least / most) + 0.5);
    double c = i * 0.0625, half = first_half(most);                   // c half and c (most - half) are exact
    Pair z = pair_div(sum_of(least - c * half, -c * (most - half)), quick_sum(most, c * least));
    // the angle is start + sign (arc + z)
    bool behind = signbit(x) != 0;
    Pair start = steep ? half_pi : behind ? pi : (Pair){0, 0};
    double sign = steep != behind ? -1 : 1;
    Pair turn = sum_of(start.high, sign * arc[i].high), at = sum_of(turn.high, sign * z.high);
    double angle = at.high + (at.low + (turn.low + start.low + sign * (arc[i].low + (z.low - beyond_arc(z.high)))));
    return copysign(angle, y);
}

double same_atan(double x) { return same_atan2(x, 1); }
double same_asin(double x) { return same_atan2(x, sqrt((1 - x) * (1 + x))); }
double same_acos(double x) { return same_atan2(sqrt((1 - x) * (1 + x)), x); }

// --- exponentials and logarithms ---

// log 2 as parts of 42 and 53 bits and a remainder
static const double log2_part1 = 0x1.62e42fefa38p-1, log2_part2 = 0x1.ef35793c7673p-45, log2_part3 = 0x1.f97b57a079a19p-103;

// e^r - 1 - r.high for |r| at most slightly above log(2) / 2, before the rounding of the last sum.
static double near_power(Pair r)
{
    double x = r.high, series = 1.0 / 3628800 + x * (1.0 / 39916800 + x * (1.0 / 479001600 + x * (1.0 / 6227020800 + x * (1.0 / 87178291200))));
    series = 1.0 / 720 + x * (1.0 / 5040 + x * (1.0 / 40320 + x * (1.0 / 362880 + x * series)));
    series = 1.0 / 6 + x * (1.0 / 24 + x * (1.0 / 120 + x * series));
    return r.low * (1 + x) + x * x * (0.5 + x * series);
}

// Splits x = k log 2 + rest, so that 2^k e^rest = e^x, for |x| below 1100. Returns k.
static int halvings(Pair x, Pair *rest)
{
    double k = nearest(x.high * (1 / 0x1.62e42fefa39efp-1));
    Pair a = sum_of(x.high - k * log2_part1, -k * log2_part2);
    *rest = quick_sum(a.high, a.low + (x.low - k * log2_part3));
    return (int)k;
}

static double power_of_e(Pair x)
{
    Pair rest;
    if (!(x.high < 710))
        return x.high + HUGE_VAL;                                     // NaN stays NaN
    if (x.high < -750)
        return 0;
    int k = halvings(x, &rest);
    Pair one = quick_sum(1, rest.high);
    double m = one.high + (one.low + near_power(rest));
    // in two steps: 2^k alone may overflow or underflow
    return m * power_of_two(k / 2) * power_of_two(k - k / 2);
}

double same_exp(double x) { return power_of_e((Pair){x, 0}); }

double same_expm1(double x)
{
    Pair rest;
    if (!(fabs(x) < 40))
        return x < 0 ? -1 : same_exp(x);
    if (x == 0)
        return x;
    int k = halvings((Pair){x, 0}, &rest);
    double two = power_of_two(k);
    Pair whole = sum_of(two - 1, two * rest.high);
    return whole.high + (whole.low + two * near_power(rest));
}

// log of 2^k (1 + f): 2 atanh(f / (2 + f)).
double same_log(double x)
{
    int k;
    if (!(x > 0) || x > DBL_MAX)
        return x == 0 ? -HUGE_VAL : x < 0 ? NAN : x;
    double m = frexp(x, &k);
    if (m < 0x1.6a09e667f3bcdp-1)
        m *= 2, k--;
    double f = m - 1, s = f / (2 + f), z = s * s, half = 0.5 * f * f, series = 2.0 / 15 + z * (2.0 / 17 + z * (2.0 / 19 + z * (2.0 / 21 + z * (2.0 / 23))));
    series = z * (2.0 / 3 + z * (2.0 / 5 + z * (2.0 / 7 + z * (2.0 / 9 + z * (2.0 / 11 + z * (2.0 / 13 + z * series))))));
    // s = (f - s f) / 2 keeps the first term exact: 2 s = f - s f
    return k * log2_part1 - ((half - (s * (half + series) + k * (log2_part2 + log2_part3))) - f);
}

// log x with error 2^-68, x > 0.
static Pair long_log(double x)
{
    int k;
    double m = frexp(x, &k);
    if (m < 0x1.6a09e667f3bcdp-1)
        m *= 2, k--;
    Pair s = pair_div((Pair){m - 1, 0}, sum_of(m, 1)), z = pair_mul(s, s);
    double q = z.high, series = 1.0 / 17 + q * (1.0 / 19 + q * (1.0 / 21 + q * (1.0 / 23 + q * (1.0 / 25 + q * (1.0 / 27)))));
    series = 1.0 / 7 + q * (1.0 / 9 + q * (1.0 / 11 + q * (1.0 / 13 + q * (1.0 / 15 + q * series))));
    const Pair third = {0x1.5555555555555p-2, 0x1.5555555555555p-56}, fifth = {0x1.999999999999ap-3, -0x1.999999999999ap-57};
    Pair sum = pair_add(third, pair_mul(z, pair_add(fifth, pair_mul(z, (Pair){series, 0}))));
    sum = pair_add(s, pair_mul(s, pair_mul(z, sum)));
    Pair twice = {2 * sum.high, 2 * sum.low}, whole = quick_sum(k * log2_part1, k * log2_part2);
    return k == 0 ? twice : pair_add(whole, (Pair){twice.high, twice.low + k * log2_part3});
}

// 0: not an integer; 1: odd; 2: even.
static int parity(double y)
{
    if (fabs(y) >= 0x1p53)
        return 2;
    return y != floor(y) ? 0 : fmod(y, 2) != 0 ? 1 : 2;
}

double same_pow(double x, double y)
{
    double size = fabs(x), sign = 1;
    if (y == 0 || x == 1)
        return 1;
    if (isnan(x) || isnan(y))
        return x + y;
    if (signbit(x)) {
        int whole = parity(y);
        if (whole == 0 && x < 0 && size <= DBL_MAX)
            return NAN;
        sign = whole == 1 ? -1 : 1;
    }
    if (size == 1)
        return sign;
    if (size == 0 || size > DBL_MAX || fabs(y) > DBL_MAX)
        return (size > 1) == (y > 0) ? sign * HUGE_VAL : sign * 0;
    Pair power = long_log(size);
    double rough = power.high * y;
    return sign * power_of_e(fabs(rough) < 800 ? pair_mul(power, (Pair){y, 0}) : (Pair){rough, 0});
}

// Newton's method from a linear estimate of m^(1/3). In the last step the residual of y^3 is exact except for its last bits.
double same_cbrt(double x)
{
    int exponent;
    if (x == 0 || !(fabs(x) <= DBL_MAX))
        return x;
    double m = frexp(fabs(x), &exponent);
    int third = (exponent + 3000) / 3 - 1000;
    m *= power_of_two(exponent - 3 * third - 3);                      // 1/16 to 1/2
    double y = 0.36 + 0.9 * m;
    for (int i = 0; i < 4; i++)
        y -= (y - m / (y * y)) / 3;
    Pair square = product_of(y, y), cube = product_of(square.high, y);
    y += ((m - cube.high) - (cube.low + square.low * y)) / (3 * square.high);
    return copysign(y * power_of_two(third + 1), x);
}

// 1 - erf x for x > 2, by the continued fraction x + (1/2) / (x + (2/2) / (x + (3/2) / …)), truncated where erf 2 is exact to the last bit.
static double upper_erf(double x, double power)
{
    double below = x;
    for (int n = 40; n > 0; n--)
        below = x + 0.5 * n / below;
    return power * 0x1.20dd750429b6dp-1 / below;
}

// erf x = 2 / sqrt(pi) e^(-x^2) (x + 2 x^3 / 3 + 4 x^5 / 15 + …): no term is negative, so there is no cancellation.
double same_erf(double x)
{
    double size = fabs(x), term = 1, sum = 0;
    if (!(size < 6))
        return x < 0 ? -1 : x > 0 ? 1 : x;
    Pair square = product_of(x, x);
    double power = power_of_e((Pair){-square.high, -square.low});
    if (size > 2)
        return copysign(1 - upper_erf(size, power), x);
    for (int n = 1; term > 1e-18 * (1 + sum); n++)
        sum += term *= 2 * square.high / (2 * n + 1);
    return 0x1.20dd750429b6dp+0 * x * (power * (1 + sum));
}
