#pragma once

/// Elementary functions that give the same bits on every x86-64 processor and C library. glibc
/// chooses variants by processor (FMA, AVX2) whose last bits differ; whatever may reach a
/// perturbation or a reward uses these instead. Less than one unit in the last place from the true
/// value. sin, cos and exp are our own and come in lanes too (elementary_kernels.h); log, atan2 and
/// the sines of more than 2048 rad are SLEEF's.
namespace treeroll::elementary {

/// Raised by each release in which one of them gives other bits: workers of different ones are of
/// different numeric classes. Version 0.1.0, which had all of them from SLEEF, had no such number.
inline constexpr int kVersion = 2;

struct SinCos {
  double sin;
  double cos;
};
/// Both for little more than one.
SinCos sin_cos(double x);

double sin(double x);
double cos(double x);
double exp(double x);
double log(double x);
double atan2(double y, double x);

}  // namespace treeroll::elementary
