// C++ twin of Foldyn's force kernel and RK4 loop, and probes of what the machine can do.
//
// Bars follow the Ogden law (exponents 5, 1), hinges the linear, superlinear or enhanced linear
// law; the mass is lumped, the damping alpha M. The element functions are templates over a scalar
// or a vector of eight lanes, so the scalar and the AVX-512 kernels are the same mathematics.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#include <immintrin.h>
#define TWIN_AVX512 1
#endif

#define INLINE static inline __attribute__((always_inline))

namespace {

constexpr double PI = 3.14159265358979323846;

typedef double lanes __attribute__((vector_size(64)));
typedef int64_t mask __attribute__((vector_size(64)));

enum Law : int64_t { LINEAR = 0, SUPERLINEAR = 1, ENHANCED = 2 };

struct Run {  // hinges [start, end) of one law; theta1 and theta2 for the enhanced linear one
    int64_t start, end, law;
    double theta1, theta2;
};

struct Model {  // nodal arrays have `stride` doubles a node: 3, or 4 with one of padding
    int64_t nodes, bars, hinges, runs;
    const double *rest;             // rest positions
    const uint32_t *bar;            // 2 nodes
    const double *bar_vector;       // 3 rows of `bars` numbers
    const double *bar_per_length2;  // 1 / L^2
    const double *bar_stiffness;    // E A / L
    const uint32_t *hinge;          // axis j, k, wings i, l
    const double *hinge_stiffness, *hinge_rest, *hinge_offset;  // moment / k = law - offset
    const Run *run;
    const double *inverse_mass;  // 0 on fixed dofs
    const double *load;
    double alpha;
};

// ---------------------------------------------------------------- arithmetic on both types
INLINE double root(double a) { return std::sqrt(a); }
INLINE double absolute(double a) { return std::fabs(a); }
INLINE double splat(double, double a) { return a; }
INLINE double choose(bool c, double a, double b) { return c ? a : b; }

#ifdef TWIN_AVX512
INLINE lanes root(lanes a) { return (lanes)_mm512_sqrt_pd((__m512d)a); }
INLINE lanes absolute(lanes a) { return (lanes)_mm512_abs_pd((__m512d)a); }
INLINE lanes splat(lanes, double a) { return (lanes)_mm512_set1_pd(a); }
INLINE lanes choose(mask c, lanes a, lanes b) { return c ? a : b; }
INLINE bool any(mask c) { return _mm512_movepi64_mask((__m512i)c) != 0; }
#endif

// atan2 without branches: two reductions to |t| <= tan(pi/8), then an odd polynomial
template <class T>
INLINE T arc_tangent(T y, T x) {
    const T zero = splat(x, 0.0);
    const T ax = absolute(x), ay = absolute(y);
    const auto steep = ay > ax;
    const T low = choose(steep, ax, ay), high = choose(steep, ay, ax);
    const auto upper = low > 0.41421356237309505 * high;
    const T t = choose(upper, low - high, low) / choose(upper, low + high, high);
    const T s = t * t;
    T q = -0.01917688711906226 * s + 0.03923165829558719;
    q = q * s - 0.0508544973794026;
    q = q * s + 0.0585814891280221;
    q = q * s - 0.06664511447381948;
    q = q * s + 0.07692183190826087;
    q = q * s - 0.09090904578123903;
    q = q * s + 0.11111111015256361;
    q = q * s - 0.14285714284666542;
    q = q * s + 0.1999999999999552;
    q = q * s - 0.3333333333333333;
    T angle = t + t * s * q + choose(upper, splat(x, 0.25 * PI), zero);
    angle = choose(steep, 0.5 * PI - angle, angle);
    angle = choose(x < zero, PI - angle, angle);
    return choose(y < zero, -angle, angle);
}

// ---------------------------------------------------------------- laws
INLINE double superlinear(double d) { return std::fabs(d) * std::cbrt(d); }

INLINE double locked(double theta, double rest, double theta1, double theta2) {
    const double edge = theta < theta1 ? theta1 : theta2;
    const double half_p = 0.5 * PI / (theta < theta1 ? theta1 : 2.0 * PI - theta2);
    return edge - rest + std::tan(half_p * (theta - edge)) / half_p;
}

template <int64_t LAW>
INLINE double moment(double theta, double rest, double offset, const Run &run) {
    if (LAW == SUPERLINEAR) return superlinear(theta - rest) - offset;
    if (LAW == ENHANCED && __builtin_expect((theta < run.theta1) | (theta > run.theta2), 0))
        return locked(theta, rest, run.theta1, run.theta2) - offset;
    return theta - rest - offset;
}

#ifdef TWIN_AVX512
// |d|^(4/3) sgn d as (d y)(|d| y) with y = |d|^(-1/3): a guess from the exponent, two steps of order 4
INLINE lanes superlinear(lanes d) {
    const __m512d a = _mm512_max_pd(_mm512_abs_pd((__m512d)d), _mm512_set1_pd(1e-200));
    const __m512i high = _mm512_srli_epi64(_mm512_castpd_si512(a), 32);
    const __m512i third = _mm512_srli_epi64(
        _mm512_mul_epu32(high, _mm512_set1_epi64(0x55555556)), 32);
    const __m512i guess = _mm512_slli_epi64(
        _mm512_sub_epi64(_mm512_set1_epi64(0x553ef0ff), third), 32);
    lanes y = (lanes)_mm512_castsi512_pd(guess);
    for (int k = 0; k < 2; k++) {
        const lanes r = 1.0 - (lanes)a * y * y * y;
        y += y * r * (1.0 / 3.0 + r * (2.0 / 9.0 + r * (14.0 / 81.0)));
    }
    return (d * y) * (absolute(d) * y);
}

template <int64_t LAW>
INLINE lanes moment(lanes theta, lanes rest, lanes offset, const Run &run) {
    if (LAW == SUPERLINEAR) return superlinear(theta - rest) - offset;
    lanes value = theta - rest - offset;
    if (LAW == ENHANCED) {
        const mask beyond = (theta < run.theta1) | (theta > run.theta2);
        if (__builtin_expect(any(beyond), 0))
            for (int q = 0; q < 8; q++)
                if (beyond[q])
                    value[q] = locked(theta[q], rest[q], run.theta1, run.theta2) - offset[q];
    }
    return value;
}
#endif

// ---------------------------------------------------------------- elements
// force of the bar on its second node is t times the current vector, which replaces d
template <class T, bool FROM_LENGTHS>
INLINE void bar_element(T d[3], const T vector[3], T per_length2, T stiffness) {
    T t;
    if (FROM_LENGTHS) {
        const T q = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * per_length2;  // stretch squared
        t = stiffness * 0.25 * (q * q - 1.0) / root(q);
    } else {
        T x = d[0] * (2.0 * vector[0] + d[0]) + d[1] * (2.0 * vector[1] + d[1]) +
              d[2] * (2.0 * vector[2] + d[2]);
        x *= per_length2;
        t = stiffness * 0.25 * x * (2.0 + x) / root(1.0 + x);  // x = stretch^2 - 1
        for (int c = 0; c < 3; c++) d[c] += vector[c];
    }
    for (int c = 0; c < 3; c++) d[c] *= t;
}

template <class T, int64_t LAW>
INLINE void hinge_element(const T p[12], T stiffness, T rest, T offset, const Run &run, T f[12]) {
    const T bx = p[3] - p[0], by = p[4] - p[1], bz = p[5] - p[2];
    const T rx = p[6] - p[0], ry = p[7] - p[1], rz = p[8] - p[2];
    const T sx = p[3] - p[9], sy = p[4] - p[10], sz = p[5] - p[11];
    const T mx = ry * bz - rz * by, my = rz * bx - rx * bz, mz = rx * by - ry * bx;
    const T nx = by * sz - bz * sy, ny = bz * sx - bx * sz, nz = bx * sy - by * sx;
    const T bb = bx * bx + by * by + bz * bz;
    const T mm = mx * mx + my * my + mz * mz;
    const T nn = nx * nx + ny * ny + nz * nz;
    const T length = root(bb);
    const T theta = PI + arc_tangent<T>(-length * (rx * nx + ry * ny + rz * nz),
                                        -(mx * nx + my * ny + mz * nz));
    const T m = stiffness * moment<LAW>(theta, rest, offset, run);
    const T once = 1.0 / (bb * mm * nn);
    const T fi = m * length * (bb * nn * once), fl = -m * length * (bb * mm * once);
    const T per_bb = mm * nn * once;
    const T rho = (rx * bx + ry * by + rz * bz) * per_bb;
    const T sigma = (sx * bx + sy * by + sz * bz) * per_bb;
    f[6] = fi * mx, f[7] = fi * my, f[8] = fi * mz;
    f[9] = fl * nx, f[10] = fl * ny, f[11] = fl * nz;
    for (int c = 0; c < 3; c++) {
        f[c] = (rho - 1.0) * f[6 + c] - sigma * f[9 + c];
        f[3 + c] = (sigma - 1.0) * f[9 + c] - rho * f[6 + c];
    }
}

// ---------------------------------------------------------------- one element at a time
template <int64_t STRIDE, bool FROM_LENGTHS>
INLINE void scalar_bars(const Model &m, int64_t first, const double *u, const double *x,
                        double *f) {
    for (int64_t e = first; e < m.bars; e++) {
        const int64_t a = STRIDE * m.bar[2 * e], b = STRIDE * m.bar[2 * e + 1];
        const double *from = FROM_LENGTHS ? x : u;
        double d[3], vector[3];
        for (int c = 0; c < 3; c++) {
            d[c] = from[b + c] - from[a + c];
            vector[c] = FROM_LENGTHS ? 0.0 : m.bar_vector[c * m.bars + e];
        }
        bar_element<double, FROM_LENGTHS>(d, vector, m.bar_per_length2[e], m.bar_stiffness[e]);
        for (int c = 0; c < 3; c++) f[a + c] -= d[c], f[b + c] += d[c];
    }
}

template <int64_t STRIDE, int64_t LAW>
INLINE void scalar_hinges(const Model &m, int64_t first, const Run &run, const double *x,
                          double *f) {
    for (int64_t e = first; e < run.end; e++) {
        const uint32_t *h = m.hinge + 4 * e;
        double p[12], g[12];
        for (int q = 0; q < 4; q++)
            for (int c = 0; c < 3; c++) p[3 * q + c] = x[STRIDE * h[q] + c];
        hinge_element<double, LAW>(p, m.hinge_stiffness[e], m.hinge_rest[e], m.hinge_offset[e],
                                   run, g);
        for (int q = 0; q < 4; q++)
            for (int c = 0; c < 3; c++) f[STRIDE * h[q] + c] += g[3 * q + c];
    }
}

template <bool FROM_LENGTHS>
struct Scalar {  // adds the internal force to f, which is zero before
    static constexpr int64_t stride = 3;
    static constexpr bool needs_displacements = !FROM_LENGTHS;
    static void add_force(const Model &m, const double *u, const double *x, double *f) {
        scalar_bars<3, FROM_LENGTHS>(m, 0, u, x, f);
        for (int64_t r = 0; r < m.runs; r++) {
            const Run &run = m.run[r];
            if (run.law == LINEAR) scalar_hinges<3, LINEAR>(m, run.start, run, x, f);
            if (run.law == SUPERLINEAR) scalar_hinges<3, SUPERLINEAR>(m, run.start, run, x, f);
            if (run.law == ENHANCED) scalar_hinges<3, ENHANCED>(m, run.start, run, x, f);
        }
    }
};

// ---------------------------------------------------------------- eight elements at a time
#ifdef TWIN_AVX512
INLINE __m512d pair(const double *low, const double *high) {
    return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(low)), _mm256_loadu_pd(high),
                              1);
}

// components of eight nodes: eight loads and a transposition beat hardware gathers
INLINE void load8(const double *x, const uint32_t *index, int64_t step, lanes out[3]) {
    const double *row[8];
    for (int q = 0; q < 8; q++) row[q] = x + 4 * (int64_t)index[step * q];
    const __m512d a = pair(row[0], row[2]), b = pair(row[1], row[3]);
    const __m512d c = pair(row[4], row[6]), d = pair(row[5], row[7]);
    const __m512d xz0 = _mm512_unpacklo_pd(a, b), xz1 = _mm512_unpacklo_pd(c, d);
    const __m512d y0 = _mm512_unpackhi_pd(a, b), y1 = _mm512_unpackhi_pd(c, d);
    out[0] = (lanes)_mm512_shuffle_f64x2(xz0, xz1, 0x88);
    out[1] = (lanes)_mm512_shuffle_f64x2(y0, y1, 0x88);
    out[2] = (lanes)_mm512_shuffle_f64x2(xz0, xz1, 0xdd);
}

INLINE void rows8(const lanes v[3], __m256d out[8]) {
    const __m512d zero = _mm512_setzero_pd();
    const __m512d xy[2] = {_mm512_unpacklo_pd((__m512d)v[0], (__m512d)v[1]),
                           _mm512_unpackhi_pd((__m512d)v[0], (__m512d)v[1])};
    const __m512d z[2] = {_mm512_unpacklo_pd((__m512d)v[2], zero),
                          _mm512_unpackhi_pd((__m512d)v[2], zero)};
    const __m512i front = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
    const __m512i back = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
    for (int odd = 0; odd < 2; odd++) {
        const __m512d low = _mm512_permutex2var_pd(xy[odd], front, z[odd]);
        const __m512d high = _mm512_permutex2var_pd(xy[odd], back, z[odd]);
        out[odd] = _mm512_castpd512_pd256(low);
        out[2 + odd] = _mm512_extractf64x4_pd(low, 1);
        out[4 + odd] = _mm512_castpd512_pd256(high);
        out[6 + odd] = _mm512_extractf64x4_pd(high, 1);
    }
}

INLINE lanes load(const double *a) { return (lanes)_mm512_loadu_pd(a); }

INLINE void add(double *f, __m256d value) {
    _mm256_storeu_pd(f, _mm256_add_pd(_mm256_loadu_pd(f), value));
}

INLINE void subtract(double *f, __m256d value) {
    _mm256_storeu_pd(f, _mm256_sub_pd(_mm256_loadu_pd(f), value));
}

template <bool FROM_LENGTHS>
struct Avx512 {
    static constexpr int64_t stride = 4;
    static constexpr bool needs_displacements = !FROM_LENGTHS;

    INLINE void bars(const Model &m, const double *u, const double *x, double *f) {
        const int64_t whole = m.bars & ~INT64_C(7);
        const double *from = FROM_LENGTHS ? x : u;
        for (int64_t e = 0; e < whole; e += 8) {
            lanes a[3], b[3], vector[3] = {};
            load8(from, m.bar + 2 * e, 2, a);
            load8(from, m.bar + 2 * e + 1, 2, b);
            for (int c = 0; c < 3; c++) {
                b[c] -= a[c];
                if (!FROM_LENGTHS) vector[c] = load(m.bar_vector + c * m.bars + e);
            }
            bar_element<lanes, FROM_LENGTHS>(b, vector, load(m.bar_per_length2 + e),
                                             load(m.bar_stiffness + e));
            __m256d row[8];
            rows8(b, row);
            for (int q = 0; q < 8; q++) {
                subtract(f + 4 * (int64_t)m.bar[2 * (e + q)], row[q]);
                add(f + 4 * (int64_t)m.bar[2 * (e + q) + 1], row[q]);
            }
        }
        scalar_bars<4, FROM_LENGTHS>(m, whole, u, x, f);
    }

    template <int64_t LAW>
    INLINE void hinges(const Model &m, const Run &run, const double *x, double *f) {
        const int64_t whole = run.start + ((run.end - run.start) & ~INT64_C(7));
        for (int64_t e = run.start; e < whole; e += 8) {
            lanes p[12], g[12];
            for (int q = 0; q < 4; q++) load8(x, m.hinge + 4 * e + q, 4, p + 3 * q);
            hinge_element<lanes, LAW>(p, load(m.hinge_stiffness + e), load(m.hinge_rest + e),
                                      load(m.hinge_offset + e), run, g);
            for (int q = 0; q < 4; q++) {
                __m256d row[8];
                rows8(g + 3 * q, row);
                for (int r = 0; r < 8; r++)
                    add(f + 4 * (int64_t)m.hinge[4 * (e + r) + q], row[r]);
            }
        }
        scalar_hinges<4, LAW>(m, whole, run, x, f);
    }

    static void add_force(const Model &m, const double *u, const double *x, double *f) {
        bars(m, u, x, f);
        for (int64_t r = 0; r < m.runs; r++) {
            const Run &run = m.run[r];
            if (run.law == LINEAR) hinges<LINEAR>(m, run, x, f);
            if (run.law == SUPERLINEAR) hinges<SUPERLINEAR>(m, run, x, f);
            if (run.law == ENHANCED) hinges<ENHANCED>(m, run, x, f);
        }
    }
};
#endif

// ---------------------------------------------------------------- the loop
double now() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

struct Memory {
    double *u, *v, *x, *f, *du, *dv;  // stage values, force, sums over the stages
};

enum Stage { FIRST, MIDDLE, LAST };

// from the force at a stage to the next stage; f is zeroed on the way
template <class Kernel, Stage STAGE>
INLINE void advance_stage(const Model &m, double dt, double ahead, double *__restrict u0,
                          double *__restrict v0, const Memory &s) {
    const int64_t n = Kernel::stride * m.nodes;
    double *__restrict u = s.u, *__restrict v = s.v, *__restrict x = s.x, *__restrict f = s.f;
    double *__restrict du = s.du, *__restrict dv = s.dv;
    const double *__restrict rest = m.rest, *__restrict load = m.load;
    const double *__restrict inverse_mass = m.inverse_mass;
    for (int64_t i = 0; i < n; i++) {
        const double a = (load[i] - f[i]) * inverse_mass[i] - m.alpha * v[i], speed = v[i];
        double next;
        f[i] = 0.0;
        if (STAGE == LAST) {
            next = u0[i] += dt / 6.0 * (du[i] + speed);
            v[i] = v0[i] += dt / 6.0 * (dv[i] + a);
        } else {
            du[i] = STAGE == FIRST ? speed : du[i] + 2.0 * speed;
            dv[i] = STAGE == FIRST ? a : dv[i] + 2.0 * a;
            next = u0[i] + ahead * speed;
            v[i] = v0[i] + ahead * a;
        }
        if (Kernel::needs_displacements) u[i] = next;
        x[i] = rest[i] + next;
    }
}

template <class Kernel>
double integrate(const Model &m, int64_t steps, double dt, double *u, double *v) {
    const int64_t n = Kernel::stride * m.nodes, room = (n + 7) / 8 * 8;
    double *memory = (double *)std::aligned_alloc(64, 6 * room * sizeof(double));
    const Memory s = {memory,            memory + room,     memory + 2 * room,
                      memory + 3 * room, memory + 4 * room, memory + 5 * room};
    for (int64_t i = 0; i < n; i++)
        s.u[i] = u[i], s.v[i] = v[i], s.x[i] = m.rest[i] + u[i], s.f[i] = s.du[i] = s.dv[i] = 0.0;
    const double began = now();
    for (int64_t step = 0; step < steps; step++) {
        Kernel::add_force(m, s.u, s.x, s.f);
        advance_stage<Kernel, FIRST>(m, dt, 0.5 * dt, u, v, s);
        Kernel::add_force(m, s.u, s.x, s.f);
        advance_stage<Kernel, MIDDLE>(m, dt, 0.5 * dt, u, v, s);
        Kernel::add_force(m, s.u, s.x, s.f);
        advance_stage<Kernel, MIDDLE>(m, dt, dt, u, v, s);
        Kernel::add_force(m, s.u, s.x, s.f);
        advance_stage<Kernel, LAST>(m, dt, 0.0, u, v, s);
    }
    const double seconds = now() - began;
    std::free(memory);
    return seconds;
}

template <class Kernel>
double evaluate(const Model &m, int64_t times, const double *u, double *f) {
    const int64_t n = Kernel::stride * m.nodes;
    double *x = (double *)std::aligned_alloc(64, (n + 7) / 8 * 8 * sizeof(double));
    for (int64_t i = 0; i < n; i++) x[i] = m.rest[i] + u[i];
    const double began = now();
    for (int64_t k = 0; k < times; k++) {
        std::memset(f, 0, n * sizeof(double));
        Kernel::add_force(m, u, x, f);
        asm volatile("" : : "r"(f) : "memory");
    }
    const double seconds = now() - began;
    std::free(x);
    return seconds;
}

}  // namespace

extern "C" {

int twin_has_avx512() {
#ifdef TWIN_AVX512
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#else
    return 0;
#endif
}

// kind: 0 scalar, 1 scalar with bars from their lengths, 2 and 3 the same with AVX-512 (stride 4).
// Seconds for all the steps, or -1 for a kind that this library does not have.
double twin_integrate(int64_t kind, const Model *m, int64_t steps, double dt, double *u,
                      double *v) {
    if (kind == 0) return integrate<Scalar<false>>(*m, steps, dt, u, v);
    if (kind == 1) return integrate<Scalar<true>>(*m, steps, dt, u, v);
#ifdef TWIN_AVX512
    if (kind == 2) return integrate<Avx512<false>>(*m, steps, dt, u, v);
    if (kind == 3) return integrate<Avx512<true>>(*m, steps, dt, u, v);
#endif
    return -1.0;
}

double twin_force(int64_t kind, const Model *m, int64_t times, const double *u, double *f) {
    if (kind == 0) return evaluate<Scalar<false>>(*m, times, u, f);
    if (kind == 1) return evaluate<Scalar<true>>(*m, times, u, f);
#ifdef TWIN_AVX512
    if (kind == 2) return evaluate<Avx512<false>>(*m, times, u, f);
    if (kind == 3) return evaluate<Avx512<true>>(*m, times, u, f);
#endif
    return -1.0;
}

// bytes per second of a[i] = b[i] + 3 c[i], three arrays of n doubles, best of `times`
double probe_triad(int64_t n, int64_t times, double *__restrict a, double *__restrict b,
                   double *__restrict c) {
    double best = 1e300;
    const int64_t inner = n < 200000 ? 200000 / n + 1 : 1;
    for (int64_t k = 0; k < times; k++) {
        const double began = now();
        for (int64_t r = 0; r < inner; r++) {
            for (int64_t i = 0; i < n; i++) a[i] = b[i] + 3.0 * c[i];
            asm volatile("" : : "r"(a) : "memory");
        }
        const double seconds = (now() - began) / inner;
        if (seconds < best) best = seconds;
    }
    return 24.0 * n / best;
}

// flop per second of independent fused multiply-adds in the widest vectors, one core
double probe_flop(int64_t rounds) {
#ifdef __AVX512F__
    typedef double wide __attribute__((vector_size(64)));
#else
    typedef double wide __attribute__((vector_size(32)));
#endif
    constexpr int chains = 10, width = sizeof(wide) / sizeof(double);
    // ten variables, not an array: that would be kept in memory
    wide b = wide{} + 0.999999, c = wide{} + 1e-7;
    wide a0 = b, a1 = b, a2 = b, a3 = b, a4 = b, a5 = b, a6 = b, a7 = b, a8 = b, a9 = b;
    const double began = now();
    for (int64_t r = 0; r < rounds; r++) {
        a0 = a0 * b + c, a1 = a1 * b + c, a2 = a2 * b + c, a3 = a3 * b + c, a4 = a4 * b + c;
        a5 = a5 * b + c, a6 = a6 * b + c, a7 = a7 * b + c, a8 = a8 * b + c, a9 = a9 * b + c;
        asm volatile("" : "+x"(a0), "+x"(a1), "+x"(a2), "+x"(a3), "+x"(a4), "+x"(a5), "+x"(a6),
                          "+x"(a7), "+x"(a8), "+x"(a9));
    }
    const double seconds = now() - began;
    return 2.0 * chains * width * rounds / seconds;
}
}
