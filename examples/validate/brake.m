function brake(events, output)
% The stick-slip of a brake with an explicit Runge-Kutta method of one's own and located events, in MATLAB or Octave.
%
%     stickslip run paper-si
%     stickslip export paper-si.h5 --table events -o events.mat
%     matlab -batch "addpath examples/validate; brake('events.mat', 'matlab.csv')"
%     octave --path examples/validate --eval "brake('events.mat', 'matlab.csv')"
%     stickslip compare paper-si.h5 matlab.csv
%
% The state is [u; u'; v; v'; theta']: rotor twist u = theta - phi_2, stator twist v = phi_1, rotor speed. The run begins at
% the kick, with the state of the reference, and takes steps of a microsecond of the Dormand-Prince pair's order 5. A step in
% which a guard changes its sign is repeated with the length that brings the guard to zero.

case_ = struct('I', 2.262, 'J', 0.0113, 'k', 7.71e6, 'c', 22.606, ...         % of the case paper-si, SI
    'rF', 0.052388 * 2225, 'breakaway', 0.6, 'low', 0.6, 'high', 0.3, 'decay', 3.5);
KICK = 5; STOP = 6.99; STEP = 1e-6;                                           % code of /events/kind, s, s

row = load(events);
at = find(row.kind == KICK, 1);
t = row.time(at);
y = [row.rotor_twist_after(at); row.rotor_twist_rate_after(at); row.phi1_after(at); row.phi1_dot_after(at); ...
    row.theta_dot_after(at)];

sense = 1;                                          % of the slip; 0 in stick
samples = zeros(ceil((STOP - t) / STEP) + 1000, 7);
count = 1;
samples(count, :) = [t, y', relative(y)];
changes = 0;
while t < STOP
    h = STEP;
    new = runge_kutta(case_, sense, y, h);
    before = guard(case_, sense, y);
    fired = guard(case_, sense, new) < 0;
    if fired && before > 0
        h = locate(case_, sense, y, h);
        new = runge_kutta(case_, sense, y, h);
    end
    y = new;
    t = t + h;
    if fired
        torque = transmitted(case_, y);
        if sense ~= 0                               % the surfaces meet at their mean speed
            half = relative(y) / 2;
            y([2 4]) = y([2 4]) + half;
        end
        if sense ~= 0 && abs(torque) <= case_.breakaway * case_.rF
            sense = 0;
        else
            sense = sign(torque);
        end
        changes = changes + 1;
    end
    count = count + 1;
    w = 0;
    if sense ~= 0 && ~fired
        w = relative(y);
    end
    samples(count, :) = [t, y', w];
end

file = fopen(output, 'w');
fprintf(file, 'time,rotor_twist,rotor_twist_rate,phi1,phi1_dot,theta_dot,relative_velocity\n');
fprintf(file, '%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n', samples(1:count, :)');
fclose(file);
fprintf('%s: %d samples, %d changes between stick and slip\n', output, count, changes);
end

function w = relative(y)                            % omega_r = phi_2' - phi_1'
w = y(5) - y(2) - y(4);
end

function T = transmitted(c, y)                      % T_f = (T_r + T_s)/2, what the interface carries in stick
T = (c.c * (y(2) + y(4)) + c.k * (y(1) + y(3))) / 2;
end

function g = guard(c, sense, y)                     % positive as long as the mode lasts
if sense == 0
    g = c.breakaway * c.rF - abs(transmitted(c, y));
else
    g = sense * relative(y);
end
end

function f = rates(c, sense, y)                     % equations (2) and (3), in stick (4)
rotor = c.c * y(2) + c.k * y(1);
stator = c.c * y(4) + c.k * y(3);
theta = -rotor / c.I;
if sense == 0
    phi2 = (rotor - stator) / (2 * c.J);
    phi1 = phi2;
else
    friction = sense * c.rF * (c.high + (c.low - c.high) * exp(-c.decay * sense * relative(y)));
    phi2 = (rotor - friction) / c.J;
    phi1 = (friction - stator) / c.J;
end
f = [y(2); theta - phi2; y(4); phi1; theta];
end

function y = runge_kutta(c, sense, y, h)            % Dormand and Prince, order 5
k1 = rates(c, sense, y);
k2 = rates(c, sense, y + h * (k1 / 5));
k3 = rates(c, sense, y + h * (k1 * 3/40 + k2 * 9/40));
k4 = rates(c, sense, y + h * (k1 * 44/45 - k2 * 56/15 + k3 * 32/9));
k5 = rates(c, sense, y + h * (k1 * 19372/6561 - k2 * 25360/2187 + k3 * 64448/6561 - k4 * 212/729));
k6 = rates(c, sense, y + h * (k1 * 9017/3168 - k2 * 355/33 + k3 * 46732/5247 + k4 * 49/176 - k5 * 5103/18656));
y = y + h * (k1 * 35/384 + k3 * 500/1113 + k4 * 125/192 - k5 * 2187/6784 + k6 * 11/84);
end

function h = locate(c, sense, y, h)                 % the step at whose end the guard is zero: false position, Illinois
low = 0; high = h;
g_low = guard(c, sense, y);
g_high = guard(c, sense, runge_kutta(c, sense, y, h));
for k = 1:50
    h = high - g_high * (high - low) / (g_high - g_low);
    g = guard(c, sense, runge_kutta(c, sense, y, h));
    if g == 0 || high - low < 1e-18
        return
    end
    if g < 0
        high = h; g_high = g; g_low = g_low / 2;
    else
        low = h; g_low = g; g_high = g_high / 2;
    end
end
end
