// Records of light sets that come and go.
#include <gpu/record_store.h>
#include <gpu/runtime_impl.h>

#include <fmt/format.h>
#include <gpu/vk_result.h>

#include <algorithm>

namespace dimmer {

Expected<void> Runtime::checkLoadable(LightSet set) const {
    DIMMER_TRY(checkSet(set));
    if (impl_->executor && !impl_->executor->records())
        return fail(ErrorCode::Unsupported, "Modes gather and scatter keep all records loaded.");
    return {};
}

Expected<void> Runtime::dropRecords(LightSet set) {
    DIMMER_TRY(checkLoadable(set));
    if (impl_->records[set.element] == RecordsState::Dropped) return {};
    hold(set, true);
    // A state that is half written must go on without these records.
    for (uint32_t i = 0; i < impl_->pages.size(); ++i) planner(i).startOver();
    impl_->records[set.element] = RecordsState::Dropped;
    std::erase_if(impl_->loading, [&](LightSet other) { return other.element == set.element; });
    if (!impl_->loader) return {};  // nothing is stored of any set
    RecordStore& store = *impl_->executor->records();
    impl_->loader->cancel(set.element, store);
    for (const uint32_t k : impl_->contributions[set.element]) store.release(k);
    return {};
}

Expected<void> Runtime::loadRecords(LightSet set) {
    DIMMER_TRY(checkLoadable(set));
    if (impl_->records[set.element] != RecordsState::Dropped) return {};
    if (impl_->loader) {
        const auto& contributions = impl_->contributions[set.element];
        RecordStore& store = *impl_->executor->records();
        if (!std::ranges::all_of(contributions, [&](uint32_t k) { return store.reserve(k); })) {
            for (const uint32_t k : contributions) store.release(k);
            return fail(ErrorCode::OutOfMemory,
                        fmt::format("Light set \"{}\": there is no room for the {} bytes of its records: {} bytes are "
                                    "free, at most {} of them in a row. Drop a light set, or create the runtime with "
                                    "more records_bytes_max.",
                                    pack().elements()[set.element].name, recordBytes(set), store.freeBytes(),
                                    store.largestFreeBytes()));
        }
        impl_->loader->add(set.element, contributions, store);
    }
    impl_->records[set.element] = RecordsState::Loading;
    impl_->loading.push_back(set);
    return {};
}

uint64_t Runtime::recordBytes(LightSet set) const {
    if (!impl_->loader || !checkSet(set)) return 0;
    uint64_t bytes = 0;
    for (const uint32_t k : impl_->contributions[set.element]) bytes += impl_->executor->records()->byteCount(k);
    return bytes;
}

uint64_t Runtime::freeRecordBytes() const {
    return impl_->loader ? impl_->executor->records()->freeBytes() : 0;
}

RecordsState Runtime::recordsState(LightSet set) const {
    return checkSet(set) ? impl_->records[set.element] : RecordsState::Dropped;
}

// Sets of which nothing is on its way any more.
void Runtime::finishLoading() {
    std::erase_if(impl_->loading, [&](LightSet set) {
        if (impl_->loader && impl_->loader->pending(set.element)) return false;
        impl_->records[set.element] = RecordsState::Loaded;
        hold(set, false);
        return true;
    });
}

Expected<LoadProgress> Runtime::continueLoading(uint64_t bytes_max) {
    if (!impl_->loader) {  // nothing is stored of any set
        finishLoading();
        return LoadProgress{};
    }
    DIMMER_TRY(impl_->loader->step(*impl_->executor->records(), bytes_max));
    finishLoading();
    return impl_->loader->progress();
}

}  // namespace dimmer
