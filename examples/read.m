% Read a result file in MATLAB: the first sticks, and the relative velocity in the stick-slip.
file = 'paper.h5';

time = h5read(file, '/events/time');            % s
kind = h5read(file, '/events/kind');
names = split(h5readatt(file, '/events/kind', 'flag_meanings'));
stick = kind == find(names == "stick") - 1;     % codes count from 0
fprintf('%d sticks, the first at %.9f s\n', sum(stick), min(time(stick)));
fprintf('onset %.9f s\n', h5readatt(file, '/stick_slip', 'onset_time'));

t = ncread(file, '/trajectory/time');           % the file is netCDF-4 too
omega_r = ncread(file, '/trajectory/relative_velocity');
unit = ncreadatt(file, '/trajectory/relative_velocity', 'units');
window = t > 6.97 & t < 6.99;
fprintf('largest relative velocity there: %g %s\n', max(omega_r(window)), unit);
