// What planning needs to know about a pack: who holds what, and how much it shows. Made once, shared, never changed.
#pragma once

#include <pack/pack_data.h>

#include <span>
#include <vector>

namespace dimmer {

// Lists of lists in one array: list i is values[first[i] .. first[i + 1]).
template <class T>
struct Lists {
    std::vector<uint32_t> first;
    std::vector<T> values;
    std::span<const T> operator[](uint32_t i) const {
        return std::span(values).subspan(first[i], first[i + 1] - first[i]);
    }
};

// A cluster that holds a contribution, and its term for it.
struct Holder {
    uint32_t cluster, term;
};

struct PlanTables {
    PlanTables(const PackData& data, const ReceiverView& receivers);

    Lists<uint32_t> contributions_of_element;
    Lists<Holder> holders_of_contribution;  // ascending by cluster
    uint32_t overlap_max = 0;               // the largest number of contributions of any cluster
};

// Per term of the texels: by how many quanta of the output at most a change of its weight by 1 moves any receiver of
// the cluster. The output is never below the base, so the base's quantum is the smallest one that the output can have.
std::vector<float> quantaPerWeight(const PackData& data);

}  // namespace dimmer
