#pragma once

/// Elementary functions that give the same bits on every x86-64 processor and C library. glibc
/// chooses variants by processor (FMA, AVX2) whose last bits differ; whatever may reach a
/// perturbation or a reward uses these instead. Accurate to 1 unit in the last place (SLEEF).
namespace treeroll::elementary {

double sin(double x);
double cos(double x);
double exp(double x);
double log(double x);
double atan2(double y, double x);

}  // namespace treeroll::elementary
