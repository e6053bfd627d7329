/**
 * @file golden.c
 * @brief Fixed-point estimator, 32-bit words, 3 operations.
 *
 * Generated from the program "golden"; do not edit.
 * Program digest: 918cdc3a116fb29c2f07a3c201dc4d4be291d953296d7ced4c9cd3af9964e51d
 */

//------------------------------------------------------------------------------
// Includes

#include "golden.h"

//------------------------------------------------------------------------------
// Definitions

#define WORD (32u) // bits of a word
#define GUARD (8u) // bits of the accumulator below the result
#define ROUND (UINT64_C(128)) // half of the result's least significant bit
#define WORD_MAX (INT64_C(2147483647))
#define WORD_MIN (-WORD_MAX - 1)
#define NORM_MAX (22u) // largest normalisation count
#define QUARTER (UINT32_C(1073741824)) // quarter of the word's range
#define FRACTION_BITS (24u) // bits below the segment index
#define FRACTION_MASK (UINT32_C(16777215))
#define INDEX_MASK (UINT32_C(127))

//------------------------------------------------------------------------------
// Variables

// Function tables: 128 segments of 4 coefficients each
static const int32_t TABLE[512] = {
    -1048576, -1044477, -1040378, -1036279,
    -1032180, -1028081, -1023982, -1019883,
    -1015784, -1011685, -1007586, -1003487,
    -999388, -995289, -991190, -987091,
    -982992, -978893, -974794, -970695,
    -966596, -962497, -958398, -954299,
    -950200, -946101, -942002, -937903,
    -933804, -929705, -925606, -921507,
    -917408, -913309, -909210, -905111,
    -901012, -896913, -892814, -888715,
    -884616, -880517, -876418, -872319,
    -868220, -864121, -860022, -855923,
    -851824, -847725, -843626, -839527,
    -835428, -831329, -827230, -823131,
    -819032, -814933, -810834, -806735,
    -802636, -798537, -794438, -790339,
    -786240, -782141, -778042, -773943,
    -769844, -765745, -761646, -757547,
    -753448, -749349, -745250, -741151,
    -737052, -732953, -728854, -724755,
    -720656, -716557, -712458, -708359,
    -704260, -700161, -696062, -691963,
    -687864, -683765, -679666, -675567,
    -671468, -667369, -663270, -659171,
    -655072, -650973, -646874, -642775,
    -638676, -634577, -630478, -626379,
    -622280, -618181, -614082, -609983,
    -605884, -601785, -597686, -593587,
    -589488, -585389, -581290, -577191,
    -573092, -568993, -564894, -560795,
    -556696, -552597, -548498, -544399,
    -540300, -536201, -532102, -528003,
    -523904, -519805, -515706, -511607,
    -507508, -503409, -499310, -495211,
    -491112, -487013, -482914, -478815,
    -474716, -470617, -466518, -462419,
    -458320, -454221, -450122, -446023,
    -441924, -437825, -433726, -429627,
    -425528, -421429, -417330, -413231,
    -409132, -405033, -400934, -396835,
    -392736, -388637, -384538, -380439,
    -376340, -372241, -368142, -364043,
    -359944, -355845, -351746, -347647,
    -343548, -339449, -335350, -331251,
    -327152, -323053, -318954, -314855,
    -310756, -306657, -302558, -298459,
    -294360, -290261, -286162, -282063,
    -277964, -273865, -269766, -265667,
    -261568, -257469, -253370, -249271,
    -245172, -241073, -236974, -232875,
    -228776, -224677, -220578, -216479,
    -212380, -208281, -204182, -200083,
    -195984, -191885, -187786, -183687,
    -179588, -175489, -171390, -167291,
    -163192, -159093, -154994, -150895,
    -146796, -142697, -138598, -134499,
    -130400, -126301, -122202, -118103,
    -114004, -109905, -105806, -101707,
    -97608, -93509, -89410, -85311,
    -81212, -77113, -73014, -68915,
    -64816, -60717, -56618, -52519,
    -48420, -44321, -40222, -36123,
    -32024, -27925, -23826, -19727,
    -15628, -11529, -7430, -3331,
    768, 4867, 8966, 13065,
    17164, 21263, 25362, 29461,
    33560, 37659, 41758, 45857,
    49956, 54055, 58154, 62253,
    66352, 70451, 74550, 78649,
    82748, 86847, 90946, 95045,
    99144, 103243, 107342, 111441,
    115540, 119639, 123738, 127837,
    131936, 136035, 140134, 144233,
    148332, 152431, 156530, 160629,
    164728, 168827, 172926, 177025,
    181124, 185223, 189322, 193421,
    197520, 201619, 205718, 209817,
    213916, 218015, 222114, 226213,
    230312, 234411, 238510, 242609,
    246708, 250807, 254906, 259005,
    263104, 267203, 271302, 275401,
    279500, 283599, 287698, 291797,
    295896, 299995, 304094, 308193,
    312292, 316391, 320490, 324589,
    328688, 332787, 336886, 340985,
    345084, 349183, 353282, 357381,
    361480, 365579, 369678, 373777,
    377876, 381975, 386074, 390173,
    394272, 398371, 402470, 406569,
    410668, 414767, 418866, 422965,
    427064, 431163, 435262, 439361,
    443460, 447559, 451658, 455757,
    459856, 463955, 468054, 472153,
    476252, 480351, 484450, 488549,
    492648, 496747, 500846, 504945,
    509044, 513143, 517242, 521341,
    525440, 529539, 533638, 537737,
    541836, 545935, 550034, 554133,
    558232, 562331, 566430, 570529,
    574628, 578727, 582826, 586925,
    591024, 595123, 599222, 603321,
    607420, 611519, 615618, 619717,
    623816, 627915, 632014, 636113,
    640212, 644311, 648410, 652509,
    656608, 660707, 664806, 668905,
    673004, 677103, 681202, 685301,
    689400, 693499, 697598, 701697,
    705796, 709895, 713994, 718093,
    722192, 726291, 730390, 734489,
    738588, 742687, 746786, 750885,
    754984, 759083, 763182, 767281,
    771380, 775479, 779578, 783677,
    787776, 791875, 795974, 800073,
    804172, 808271, 812370, 816469,
    820568, 824667, 828766, 832865,
    836964, 841063, 845162, 849261,
    853360, 857459, 861558, 865657,
    869756, 873855, 877954, 882053,
    886152, 890251, 894350, 898449,
    902548, 906647, 910746, 914845,
    918944, 923043, 927142, 931241,
    935340, 939439, 943538, 947637,
    951736, 955835, 959934, 964033,
    968132, 972231, 976330, 980429,
    984528, 988627, 992726, 996825,
    1000924, 1005023, 1009122, 1013221,
    1017320, 1021419, 1025518, 1029617,
    1033716, 1037815, 1041914, 1046013,
};

//------------------------------------------------------------------------------
// Functions

// floor(x / 2^s)
static inline int64_t shift_right(const int64_t x, const uint32_t s) {
    if ((((int64_t) -1) >> 1) == -1 || x >= 0) { // the left side is a constant: >> is arithmetic
        return x >> s;
    }
    return ~(~x >> s);
}

// floor(a * b / 2^s), modulo 2^64
static inline uint64_t mul_shift(const int32_t a, const int32_t b, const uint32_t s) {
    return (uint64_t) shift_right((int64_t) a * b, s);
}

// s - n, not below 0
static inline uint32_t shift_less(const uint32_t s, const uint32_t n) {
    return s > n ? s - n : 0u;
}

// -t where the mask is set
static inline uint64_t negate_where(const uint64_t t, const uint64_t mask) {
    return (t ^ mask) - mask;
}

// All ones when x is negative
static inline uint64_t sign_mask(const int32_t x) {
    return UINT64_C(0) - (uint64_t) (x < 0);
}

// All ones when x plus a quarter of the range, modulo the range, is negative
static inline uint64_t sign_mask_quarter(const int32_t x) {
    return UINT64_C(0) - (uint64_t) ((((uint32_t) x + QUARTER) >> (WORD - 1u)) & 1u);
}

// Leading zeros of x, which is not 0
static inline uint32_t leading_zeros(const uint32_t x) {
#if defined(__GNUC__) && __SIZEOF_INT__ == 4
    return (uint32_t) __builtin_clz(x);
#else
    uint32_t count = 0u;
    while (((x << count) & UINT32_C(0x80000000)) == 0u) {
        count++;
    }
    return count;
#endif
}

// Normalisation count: copies of the sign bit below the sign bit, at most NORM_MAX
static inline uint32_t sign_count(const int32_t x) {
    const uint32_t magnitude = (x < 0 ? ~(uint32_t) x : (uint32_t) x) | 1u;
    const uint32_t count = leading_zeros(magnitude) + WORD - 33u;
    return count < NORM_MAX ? count : NORM_MAX;
}

// segment_index of x plus a quarter of the range
static inline uint32_t segment_index_quarter(const int32_t x) {
    return (((uint32_t) x + QUARTER) >> FRACTION_BITS) & INDEX_MASK;
}

// Bits of x below the segment index
static inline int32_t fraction(const int32_t x) {
    return (int32_t) ((uint32_t) x & FRACTION_MASK);
}

// Two's complement reading of x
static inline int64_t to_signed(const uint64_t x) {
    return x <= (uint64_t) INT64_MAX ? (int64_t) x : -(int64_t) ~x - 1;
}

// Result of an accumulator, clamped
static inline int32_t clip(const uint64_t acc) {
    const int64_t q = shift_right(to_signed(acc), GUARD);
    if (q > WORD_MAX) {
        return (int32_t) WORD_MAX;
    }
    return q < WORD_MIN ? (int32_t) WORD_MIN : (int32_t) q;
}

// Result of an accumulator, clamped; raises the flag
static inline int32_t saturate(const uint64_t acc, bool *const saturated) {
    const int64_t q = shift_right(to_signed(acc), GUARD);
    if (q > WORD_MAX) {
        *saturated = true;
        return (int32_t) WORD_MAX;
    }
    if (q < WORD_MIN) {
        *saturated = true;
        return (int32_t) WORD_MIN;
    }
    return (int32_t) q;
}

// Result of an accumulator modulo 2^WORD
static inline int32_t wrap(const uint64_t acc) {
    const uint64_t half = UINT64_C(1) << (WORD - 1u);
    const uint64_t q = (uint64_t) shift_right(to_signed(acc), GUARD);
    return (int32_t) ((int64_t) ((q + half) & ((half << 1) - 1u)) - (int64_t) half);
}

void golden_init(golden_t *const self) {
    self->params.gain = 536870912; // fixed<32,1>
    golden_reset(self);
}

void golden_reset(golden_t *const self) {
    self->state.angle_ht = 0; // fixed<32,1>
}

void golden_update(golden_t *const self, const golden_in_t *const in, golden_out_t *const out) {
    const int32_t v0_rate = in->rate; // fixed<32,5>, rad/s, [-16, 16]
    const int32_t v2_gain = self->params.gain; // fixed<32,1>, [0, 1]
    const int32_t v3_angle_ht = self->state.angle_ht; // fixed<32,1>, half turns, [-1, 1]
    bool saturated = false;
    bool beyond = false;
    uint64_t acc; // accumulator, modulo 2^64
    uint64_t flag; // all ones where the sign bit of the flag is set
    uint32_t n; // normalisation count
    const int32_t *segment; // coefficients of one segment of a table

    // turned_ht: fixed<32,1>, half turns, [-1, 1], WRAP
    acc = ROUND;
    acc += mul_shift(v3_angle_ht, 687194767, 29u); // dt
    acc += mul_shift(v0_rate, 687194767, 26u); // dt
    const int32_t v4_turned_ht = wrap(acc);

    // sine: fixed<32,2>, [-1, 1], SAT
    flag = sign_mask_quarter(v4_turned_ht);
    segment = &TABLE[0u + 4u * segment_index_quarter(v4_turned_ht)];
    acc = ROUND;
    acc += mul_shift(fraction(v4_turned_ht), segment[1], 24u);
    acc += negate_where(mul_shift(687194767, segment[0], 30u), flag); // dt
    const int32_t v5_sine = saturate(acc, &saturated);

    // smooth: fixed<32,5>, rad/s, [-16, 16], CLIP
    flag = sign_mask(v0_rate);
    n = sign_count(v0_rate);
    acc = ROUND;
    acc += mul_shift(v0_rate, v2_gain, 23u);
    acc += mul_shift(v0_rate, v5_sine, shift_less(25u, n)) & ~flag;
    const int32_t v6_smooth = clip(acc);

    out->angle_ht = v4_turned_ht;
    out->smooth = v6_smooth;
    out->saturated = saturated;
    out->beyond = beyond;
    self->state.angle_ht = v4_turned_ht;
}

//------------------------------------------------------------------------------
// End of file
