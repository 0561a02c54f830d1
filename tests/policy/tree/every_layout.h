#pragma once

#include "common/policy/tree/frame.h"
#include "common/policy/tree/theta_layout.h"

namespace treeroll {

inline constexpr FrameKind kFrameKinds[] = {FrameKind::kEigenvector, FrameKind::kCholesky};

inline constexpr ThetaLayout kLayouts[] = {
    ThetaLayout::kMeans, ThetaLayout::kMeansCholesky, ThetaLayout::kMeansPourahmadi,
    ThetaLayout::kReducedCholesky, ThetaLayout::kReducedPourahmadi};

/// Those whose theta holds couplings (psi) beside the means.
inline constexpr ThetaLayout kLayoutsWithPsi[] = {
    ThetaLayout::kMeansCholesky, ThetaLayout::kMeansPourahmadi, ThetaLayout::kReducedCholesky,
    ThetaLayout::kReducedPourahmadi};

}  // namespace treeroll
