# Read a result file in Julia: the first sticks, and the relative velocity in the stick-slip. Needs HDF5.jl.
using HDF5

h5open("paper.h5") do file
    time = read(file["events/time"])            # s
    kind = file["events/kind"]
    names = split(read_attribute(kind, "flag_meanings"))
    stick = read(kind) .== findfirst(==("stick"), names) - 1    # codes count from 0
    println(count(stick), " sticks, the first at ", minimum(time[stick]), " s")
    println("onset ", read_attribute(file["stick_slip"], "onset_time"), " s")

    t = read(file["trajectory/time"])
    omega_r = file["trajectory/relative_velocity"]
    window = 6.97 .< t .< 6.99
    println("largest relative velocity there: ", maximum(read(omega_r)[window]), " ", read_attribute(omega_r, "units"))
end
